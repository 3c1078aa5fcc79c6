#include "bank_filter.hpp"

namespace surefix::switching {

ConfigStatus make_scalar_of_3(Method method, const FilterPlan& plan,
                              std::unique_ptr<AnyFilter>& out) {
  return make_bank<Sizes<1, 3>>(method, plan, out);
}

}  // namespace surefix::switching
