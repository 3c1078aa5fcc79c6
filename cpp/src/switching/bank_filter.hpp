// `AnyFilter` for sizes S; each file that makes them compiles some.
#pragma once

#include "surefix/switching/any_filter.hpp"
#include "surefix/switching/bank_batch.hpp"

namespace surefix::switching {

template <class S>
ConfigStatus make_bank(Method method, const FilterPlan& plan, std::unique_ptr<AnyFilter>& out) {
  class Bank final : public AnyFilter {
   public:
    Bank(Method method, BankBatch<S> batch) : method_(method), batch_(std::move(batch)) {}
    [[nodiscard]] BatchStatus run(const BatchRequest& in, const BatchOutput& out) const override {
      return method_ == Method::imm ? batch_.template run<Method::imm>(in, out)
                                    : batch_.template run<Method::one_step>(in, out);
    }

   private:
    Method method_;
    BankBatch<S> batch_;
  };
  BankBatch<S> batch;
  const ConfigStatus status = batch.make(plan.systems, plan.chain, plan.p, plan.map);
  if (status == ConfigStatus::ok) out = std::make_unique<Bank>(method, std::move(batch));
  return status;
}

/// Whether the transitions are those of the chain's modes.
bool fits(const ModeChain& chain, const std::vector<Eigen::MatrixXd>& p);

/// Whether the fixed sizes S are the plan's.
template <class S>
bool is_for(const FilterPlan& plan) {
  const LinearSystem& system = plan.systems.front();
  return plan.systems.size() == 1 && system.size() == S::n && system.measured() == S::m &&
         plan.chain.size() == S::M;
}

ConfigStatus make_scalar_of_3(Method method, const FilterPlan& plan,
                              std::unique_ptr<AnyFilter>& out);
ConfigStatus make_scalar_of_4(Method method, const FilterPlan& plan,
                              std::unique_ptr<AnyFilter>& out);
ConfigStatus make_of_any_size(Method method, const FilterPlan& plan,
                              std::unique_ptr<AnyFilter>& out);

}  // namespace surefix::switching
