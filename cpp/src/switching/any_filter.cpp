#include "surefix/switching/any_filter.hpp"

#include "bank_filter.hpp"
#include "genie_filter.hpp"

namespace surefix::switching {

ConfigStatus AnyFilter::make(Method method, const FilterPlan& plan,
                             std::unique_ptr<AnyFilter>& out) {
  if (is_for<Sizes<1, 3>>(plan)) return make_scalar_of_3(method, plan, out);
  if (is_for<Sizes<1, 4>>(plan)) return make_scalar_of_4(method, plan, out);
  return make_of_any_size(method, plan, out);
}

ConfigStatus AnyFilter::make_genie(const LinearSystem& system, const std::vector<Mode>& modes,
                                   std::unique_ptr<AnyFilter>& out) {
  if (system.size() == 1 && system.measured() == 1) return make_scalar_genie(system, modes, out);
  return make_known<AnySizes>(system, modes, out);
}

}  // namespace surefix::switching
