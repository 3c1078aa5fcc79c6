#include "surefix/switching/any_filter.hpp"

#include "bank_filter.hpp"
#include "genie_filter.hpp"

namespace surefix::switching {
namespace {

/// Whether the map knows every state of every system.
bool fits(const StateMap& map, const std::vector<LinearSystem>& systems) {
  if (map.size() == 0) {
    for (const LinearSystem& system : systems)
      if (system.size() != systems.front().size()) return false;
    return true;
  }
  if (map.size() > AnySizes::max_n || map.states.size() != systems.size() ||
      map.all.size() != map.mean.size() || map.variance.size() != map.mean.size())
    return false;
  for (std::size_t s = 0; s < systems.size(); ++s) {
    if (static_cast<int>(map.states[s].size()) != systems[s].size()) return false;
    for (const int number : map.states[s])
      if (number < 0 || number >= map.size()) return false;
  }
  return true;
}

}  // namespace

bool fits(const ModeChain& chain, const std::vector<Eigen::MatrixXd>& p) {
  const auto M = static_cast<std::size_t>(chain.size());
  if (M == 0 || p.empty() || chain.branches.size() != M ||
      static_cast<std::size_t>(chain.initial.size()) != M)
    return false;
  for (const Eigen::MatrixXd& P : p)
    if (static_cast<std::size_t>(P.rows()) != M || static_cast<std::size_t>(P.cols()) != M)
      return false;
  return static_cast<std::size_t>(chain.transition.cols()) == M;
}

ConfigStatus AnyFilter::make(Method method, const FilterPlan& plan,
                             std::unique_ptr<AnyFilter>& out) {
  const std::size_t systems = plan.systems.size();
  if (!fits(plan.chain, plan.p) || systems == 0 ||
      (systems > 1 && static_cast<int>(systems) != plan.chain.size()) ||
      !fits(plan.map, plan.systems))
    return ConfigStatus::wrong_size;
  for (const LinearSystem& system : plan.systems)
    if (system.measured() != plan.systems.front().measured()) return ConfigStatus::wrong_size;
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
