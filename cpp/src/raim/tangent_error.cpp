#include "surefix/raim/tangent_error.hpp"

#include <algorithm>
#include <cmath>

#include "epoch_problem.hpp"

namespace surefix::raim {
namespace {

constexpr int samples = 8;            // on each side of l̂
constexpr double sagnac_bend = 2e-5;  // of a satellite's, ω |s|/c, in units of the track's bend

}  // namespace

TangentError::Bounds TangentError::over(double half) const noexcept {
  const Problem problem{track_, satellites_, selection_, settings_.rotation,
                        fix_.geometry.clocks()};
  const TrackPoint at = track_.at(fix_.along);
  const double bend = track_.bend_bound(fix_.along - half, fix_.along + half);
  Values range, slope;
  double curved = 0.0;  // Σ (sup|d_i''|/σ_i)²
  for (int k = 0; k < selection_.size; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Sight sight = look(at, problem.satellite(k).position, settings_.rotation);
    range[i] = sight.range;
    slope[i] = sight.slope;
    // The line of sight to a satellite turns by 1e-7 rad/m: over the interval that is the same but
    // for less than itself.
    const double second = (1.0 + sagnac_bend) * bend + 2.0 * sight.turning;
    curved += second * second * problem.clocks.root_weight(k) * problem.clocks.root_weight(k);
  }
  double parity = 0.0, whole = 0.0;
  for (int p = -samples; p <= samples; ++p) {
    if (p == 0) continue;
    const double move = half * p / samples;
    const TrackPoint point = track_.at(fix_.along + move);
    Values error;
    for (int k = 0; k < selection_.size; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double there = look(point, problem.satellite(k).position, settings_.rotation).range;
      error[i] = (there - range[i] - slope[i] * move) * problem.clocks.root_weight(k);
    }
    problem.clocks.remove(error.data());
    whole = std::max(whole, problem.square(error));
    fix_.geometry.remove(error.data());
    parity = std::max(parity, problem.square(error));
  }
  const double spacing = half / samples, between = std::sqrt(curved) * spacing * spacing / 8.0;
  return {std::sqrt(parity) + between, std::sqrt(whole) + between};
}

}  // namespace surefix::raim
