#include "surefix/switching/any_filter.hpp"

#include "bank_filter.hpp"

namespace surefix::switching {
namespace {

template <class S>
ConfigStatus genie(const LinearSystem& system, const std::vector<Mode>& modes,
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

}  // namespace

ConfigStatus AnyFilter::make(Method method, const FilterPlan& plan,
                             std::unique_ptr<AnyFilter>& out) {
  if (is_for<Sizes<1, 3>>(plan)) return make_scalar_of_3(method, plan, out);
  if (is_for<Sizes<1, 4>>(plan)) return make_scalar_of_4(method, plan, out);
  return make_of_any_size(method, plan, out);
}

ConfigStatus AnyFilter::make_genie(const LinearSystem& system, const std::vector<Mode>& modes,
                                   std::unique_ptr<AnyFilter>& out) {
  if (system.size() == 1 && system.measured() == 1) return genie<Sizes<1, 1>>(system, modes, out);
  return genie<AnySizes>(system, modes, out);
}

}  // namespace surefix::switching
