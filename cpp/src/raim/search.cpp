#include "surefix/raim/search.hpp"

#include <algorithm>
#include <cmath>

#include "epoch_problem.hpp"

namespace surefix::raim {
namespace {

constexpr int most_strides = 4096;

/// Calls dip(l, stride) for the dips of √S in K near or below the level; returns whether it came to
/// the end.
template <class Dip>
bool walk(const Problem& problem, const Ends& K, double level, Dip&& dip) noexcept {
  const double kappa = problem.steepest(0.5 * (K.low + K.high), 0.5 * (K.high - K.low));
  const double shortest = level / kappa / 12.0, near = level + kappa * shortest;
  double l = K.low, before = std::numeric_limits<double>::infinity();
  double here = std::sqrt(problem.left(l));
  for (int step = 0; step < most_strides; ++step) {
    const double next_l = std::min(l + std::max(shortest, (here - level) / kappa), K.high);
    const bool end = !(l < K.high);
    const double next =
        end ? std::numeric_limits<double>::infinity() : std::sqrt(problem.left(next_l));
    if (here <= near && here < before && here <= next) dip(l, shortest);
    if (end) return true;
    before = here;
    here = next;
    l = next_l;
  }
  return false;
}

}  // namespace

Search search(const Track& track, const Satellite* satellites, const Selection& selection,
              const MonitorSettings& settings, const MonitorTables& tables,
              const Whereabouts& where) noexcept {
  Search found{find_fix(track, satellites, selection, settings, where)};
  Fix& best = found.fix;
  if (best.geometry.size() == 0 || !best.geometry.determined()) return found;

  const double threshold = tables.test(best.geometry.degrees()).threshold;
  const Problem problem{track, satellites, selection, settings.rotation, best.geometry.clocks()};
  const Ends K = ends(track, settings, where);
  const double least = best.ok() ? best.statistic : problem.left(problem.scan(K.low, K.high));
  double first = std::numeric_limits<double>::infinity(), last = -first;  // of those that pass
  const auto count = [&](double l, double statistic) {
    if (!(statistic < threshold)) return;
    first = std::min(first, l);
    last = std::max(last, l);
  };
  if (best.ok()) count(best.along, best.statistic);
  const Fix near = best;
  const double level = std::sqrt(std::max(least, threshold));
  const bool whole = walk(problem, K, level, [&](double l, double stride) {
    if (near.ok() && std::abs(l - near.along) <= stride) return;
    const Fix other =
        find_fix(track, satellites, selection, settings, {l, where.low, where.high, stride});
    if (other.ok())
      count(other.along, other.statistic);
    else
      count(l, problem.left(l));  // an end of K
    if (other.ok() && (!best.ok() || other.statistic < best.statistic)) best = other;
  });
  if (!best.ok()) return found;
  const double far = std::max(best.along - first, last - best.along);
  if (far > 2.0 * settled) found.rival = far;
  if (!whole) found.rival = std::numeric_limits<double>::infinity();
  return found;
}

}  // namespace surefix::raim
