#include "surefix/robust/alert_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace surefix::robust {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double root_half = 0.70710678118654752440;     // √(1/2)
constexpr double root_2_by_pi = 0.79788456080286535588;  // √(2/π)
constexpr double precision = 1e-13;  // of the tail: by how much a limit may be too safe, for speed
constexpr int most_steps = 120;      // 3 to 5 are usual, 60 at a point mass

/// The mixture, or its mirror image (side = −1): the lower tail of one is the upper of the other.
struct Sided {
  const TailMixture& mixture;
  double side;

  double weight(std::size_t i) const { return mixture.weight[i]; }
  double mean(std::size_t i) const { return side * mixture.mean[i]; }
  double sigma(std::size_t i) const { return mixture.sigma[i]; }
};

struct Tail {
  double probability;
  double density;  ///< −d probability / dx
  double slope;    ///< −d density / dx
};

/// What lies beyond x. Up to `negligible`, a component may be taken for what bounds it from above:
/// that saves most of the erfc, and so of the time.
Tail tail_beyond(const Sided& m, double x, double negligible) {
  Tail sum{0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < m.mixture.count; ++i) {
    const double w = m.weight(i), d = x - m.mean(i), sigma = m.sigma(i);
    if (w <= negligible) {
      sum.probability += w;
    } else if (sigma == 0.0 && !std::isnan(d)) {
      sum.probability += d < 0.0 ? w : 0.0;
    } else {
      const double z = d / sigma;
      const double bound = 0.5 * w * std::exp(-0.5 * z * z);  // ≥ w P(N(0, 1) > |z|)
      if (bound <= negligible) {
        sum.probability += z > 0.0 ? bound : w;
      } else {
        sum.probability += w * 0.5 * std::erfc(z * root_half);
        const double density = root_2_by_pi * bound / sigma;
        sum.density += density;
        sum.slope += density * z / sigma;
      }
    }
  }
  return sum;
}

struct Bracket {
  double low, high;
};

/// low ≤ limit ≤ high. One component alone must keep below `tail`; all do together where each keeps
/// below its share. The bounds of a component, with Q(z) = P(N(0, 1) > z), are
/// −√(2/π) z − z²/2 ≤ log 2Q(z) ≤ −z²/2 for z ≥ 0 (the hazard starts at √(2/π), its slope is < 1).
/// (+∞, +∞) for a mixture that is none, (−∞, −∞) if all of it is within the tail.
Bracket bracket(const Sided& m, double tail) {
  const std::size_t count = m.mixture.count;
  double total = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double w = m.weight(i), sigma = m.sigma(i);
    if (!(w >= 0.0 && sigma >= 0.0 && std::isfinite(sigma) && std::isfinite(m.mean(i)))) {
      return {infinity, infinity};
    }
    total += w;
  }
  if (!std::isfinite(total)) return {infinity, infinity};
  if (total <= tail) return {-infinity, -infinity};

  // Where no component keeps more than (total − tail) / total of itself below, the tail is reached.
  const double below = std::sqrt(2.0 * std::max(0.0, std::log(0.5 / (1.0 - tail / total))));
  const double share = 0.5 * tail / static_cast<double>(count);  // half: room for rounding
  const double all_to_share = 2.0 * std::log(tail / share);
  double floor = infinity, low = -infinity, high = -infinity;
  for (std::size_t i = 0; i < count; ++i) {
    const double w = m.weight(i), mean = m.mean(i), sigma = m.sigma(i);
    if (w > 0.0) floor = std::min(floor, mean - sigma * below);
    if (!(w > share)) continue;
    const double c = 2.0 * std::log(0.5 * w / share);  // z² at the outer bound, if positive
    high = std::max(high, mean + sigma * std::sqrt(std::max(0.0, c)));
    const double c_alone = c - all_to_share;  // where it has all of the tail
    if (c_alone < 0.0) continue;
    const double z = std::sqrt(root_2_by_pi * root_2_by_pi + c_alone) - root_2_by_pi;
    low = std::max(low, mean + sigma * z);
  }
  low = std::max(low, floor);
  return {low - 2.0 * epsilon * std::abs(low), high + 2.0 * epsilon * std::abs(high)};
}

/// Newton on the logarithm of the tail with its second derivative (that of a Gaussian is nearly a
/// parabola), kept in a bracket whose upper end is always safe. NaN steps bisect.
double limit(const Sided& m, double tail) {
  if (!(tail > 0.0)) return infinity;
  Bracket b = bracket(m, tail);
  if (!std::isfinite(b.high)) return b.high;
  const double negligible = precision * tail / static_cast<double>(m.mixture.count);

  double x = b.low, last_step = infinity;
  for (int k = 0; k < most_steps; ++k) {
    const Tail at = tail_beyond(m, x, negligible);
    const bool safe = at.probability <= tail;
    (safe ? b.high : b.low) = x;
    const double log_ratio = std::log(at.probability / tail);
    const double length = at.probability / at.density;  // over which the tail falls by a factor e
    const double bend = at.slope * length / at.density - 1.0;  // its second derivative · length²
    const double step = 2.0 * length * log_ratio / (1.0 + std::sqrt(1.0 - 2.0 * bend * log_ratio));
    const double width = b.high - b.low;
    const double rounding = epsilon * std::abs(x) + precision * std::min(width, length);
    if (width <= 2.0 * rounding) return b.high;
    if (safe && step >= -2.0 * rounding) return x;

    const double next = x + step + rounding;  // beyond the root, so that the next one is safe
    const bool good = next > b.low && next < b.high && std::abs(step) <= 0.5 * last_step;
    last_step = good ? std::abs(step) : infinity;
    x = good ? next : b.low + 0.5 * width;
  }
  return b.high;
}

}  // namespace

double upper_tail(const TailMixture& mixture, double x) noexcept {
  return tail_beyond({mixture, 1.0}, x, 0.0).probability;
}

double lower_tail(const TailMixture& mixture, double x) noexcept {
  return tail_beyond({mixture, -1.0}, -x, 0.0).probability;
}

double upper_limit(const TailMixture& mixture, double tail) noexcept {
  return limit({mixture, 1.0}, tail);
}

double lower_limit(const TailMixture& mixture, double tail) noexcept {
  return -limit({mixture, -1.0}, tail);
}

AlertLimits find_limits(const TailMixture& mixture, double risk, Sides sides) noexcept {
  const double tail = sides == Sides::both ? 0.5 * risk : risk;
  return {sides == Sides::upper ? -infinity : lower_limit(mixture, tail),
          sides == Sides::lower ? infinity : upper_limit(mixture, tail)};
}

double per_estimate(double risk, double exposures) noexcept {
  if (!(risk >= 0.0 && risk <= 1.0 && exposures > 0.0)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return -std::expm1(std::log1p(-risk) / exposures);
}

}  // namespace surefix::robust
