#include "genie_filter.hpp"

namespace surefix::switching {

ConfigStatus make_scalar_genie(const LinearSystem& system, const std::vector<Mode>& modes,
                               std::unique_ptr<AnyFilter>& out) {
  return make_known<Sizes<1, 1>>(system, modes, out);
}

}  // namespace surefix::switching
