#include "bank_filter.hpp"

namespace surefix::switching {

ConfigStatus make_of_any_size(Method method, const FilterPlan& plan,
                              std::unique_ptr<AnyFilter>& out) {
  return make_bank<AnySizes>(method, plan, out);
}

}  // namespace surefix::switching
