#include "bank_filter.hpp"

namespace surefix::switching {

ConfigStatus make_scalar_of_4(Method method, const FilterPlan& plan,
                              std::unique_ptr<AnyFilter>& out) {
  return make_bank<Sizes<1, 4>>(method, plan, out);
}

}  // namespace surefix::switching
