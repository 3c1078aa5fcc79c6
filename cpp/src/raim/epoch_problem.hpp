// One epoch's satellites in use, as seen from anywhere on the track: what a
// solution leaves of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "surefix/raim/fix.hpp"

namespace surefix::raim {

inline constexpr double settled = 1e-6;  // [m], when the iteration has
inline constexpr int places = 65;        // where S is looked at in K before anything is known

using Values = std::array<double, max_satellites>;

/// The satellites in use, as seen from anywhere on the track.
struct Problem {
  const Track& track;
  const Satellite* satellites;
  const Selection& selection;
  double rotation;
  Clocks clocks{};

  [[nodiscard]] const Satellite& satellite(int k) const noexcept {
    return satellites[selection.index[static_cast<std::size_t>(k)]];
  }
  /// y = (r − d(l))/σ, d'(l) and d''(l) of all satellites.
  void look_from(double l, Values& y, Values& slope, Values& second) const noexcept {
    const TrackPoint point = track.at(l);
    for (int k = 0; k < selection.size; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const Sight sight = look(point, satellite(k).position, rotation);
      y[i] = (satellite(k).pseudorange - sight.range) * clocks.root_weight(k);
      slope[i] = sight.slope;
      second[i] = sight.second;
    }
  }
  [[nodiscard]] double square(const Values& y) const noexcept {
    double sum = 0.0;
    for (int k = 0; k < selection.size; ++k)
      sum += y[static_cast<std::size_t>(k)] * y[static_cast<std::size_t>(k)];
    return sum;
  }
  /// S(l) = ‖y‖², clocks removed.
  [[nodiscard]] double left(double l) const noexcept {
    const TrackPoint point = track.at(l);
    Values y;
    for (int k = 0; k < selection.size; ++k) {
      const double range = look(point, satellite(k).position, rotation).range;
      y[static_cast<std::size_t>(k)] = (satellite(k).pseudorange - range) * clocks.root_weight(k);
    }
    clocks.remove(y.data());
    return square(y);
  }
  /// κ ≥ ‖(I − clocks) d'/σ‖ everywhere within `reach` of l: what a step in the worst direction
  /// does at l, and how far lines of sight turn on the way.
  [[nodiscard]] double steepest(double l, double reach) const noexcept {
    const Point c = track.at(l).position;
    std::array<Values, 3> axes;
    double turned = 0.0;
    for (int k = 0; k < selection.size; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const Point along = gradient(c, satellite(k).position, rotation);
      for (std::size_t j = 0; j < 3; ++j) axes[j][i] = along[j] * clocks.root_weight(k);
      const double turn = 2.0 * track.stretch() * reach / distance(c, satellite(k).position);
      turned += turn * turn * clocks.root_weight(k) * clocks.root_weight(k);
    }
    for (Values& axis : axes) clocks.remove(axis.data());
    // The largest eigenvalue of A = axesᵀ axes is tr A/3 + √(2/3 (tr A² − (tr A)²/3)) at most
    // (Wolkowicz & Styan 1980).
    double trace = 0.0, squares = 0.0;
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) {
        double product = 0.0;
        for (int k = 0; k < selection.size; ++k)
          product += axes[a][static_cast<std::size_t>(k)] * axes[b][static_cast<std::size_t>(k)];
        if (a == b) trace += product;
        squares += product * product;
      }
    const double spread = std::max(squares - trace * trace / 3.0, 0.0);
    const double largest = trace / 3.0 + std::sqrt(2.0 / 3.0 * spread);
    return track.stretch() * (std::sqrt(largest) + std::sqrt(turned));
  }
  /// Where in [low, high] S is least, roughly.
  [[nodiscard]] double scan(double low, double high) const noexcept {
    double least = std::numeric_limits<double>::infinity(), best = low;
    for (int p = 0; p < places; ++p) {
      const double l = low + (high - low) * p / (places - 1), value = left(l);
      if (value < least) least = value, best = l;
    }
    return best;
  }
  /// Σ r_i d_i''/σ_i: what the track's bend adds to S''/2 = G − it.
  [[nodiscard]] double bending(const Values& r, const Values& second) const noexcept {
    double sum = 0.0;
    for (int k = 0; k < selection.size; ++k) {
      const auto i = static_cast<std::size_t>(k);
      sum += r[i] * second[i] * clocks.root_weight(k);
    }
    return sum;
  }
};

struct Ends {
  double low, high;
};
/// K, on the track.
[[nodiscard]] inline Ends ends(const Track& track, const MonitorSettings& settings,
                               const Whereabouts& where) noexcept {
  return {std::max(where.low, track.low() - settings.interval),
          std::min(where.high, track.high() + settings.interval)};
}

}  // namespace surefix::raim
