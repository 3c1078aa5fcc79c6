// The genie as an `AnyFilter` for sizes S; each file that makes one compiles it.
#pragma once

#include "surefix/switching/any_filter.hpp"
#include "surefix/switching/genie_batch.hpp"

namespace surefix::switching {

template <class S>
ConfigStatus make_known(const LinearSystem& system, const std::vector<Mode>& modes,
                        std::unique_ptr<AnyFilter>& out) {
  class Known final : public AnyFilter {
   public:
    explicit Known(GenieBatch<S> batch) : batch_(std::move(batch)) {}
    [[nodiscard]] BatchStatus run(const BatchRequest& in, const BatchOutput& out) const override {
      return batch_.run(in, out);
    }

   private:
    GenieBatch<S> batch_;
  };
  GenieBatch<S> batch;
  const ConfigStatus status = batch.make(system, modes);
  if (status == ConfigStatus::ok) out = std::make_unique<Known>(std::move(batch));
  return status;
}

ConfigStatus make_scalar_genie(const LinearSystem& system, const std::vector<Mode>& modes,
                               std::unique_ptr<AnyFilter>& out);

}  // namespace surefix::switching
