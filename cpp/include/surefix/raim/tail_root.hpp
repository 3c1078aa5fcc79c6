// The smallest x at which a decreasing tail probability is down to a target.
#pragma once

#include <algorithm>
#include <cmath>

namespace surefix::raim {

/// A tail at x and −d tail/dx.
struct TailValue {
  double probability;
  double density;
};

/// P(N(0, σ²) > x).
[[nodiscard]] inline TailValue gaussian_tail(double x, double sigma) noexcept {
  const double z = x / sigma;
  return {0.5 * std::erfc(z * 0.70710678118654752440),
          0.39894228040143267794 * std::exp(-0.5 * z * z) / sigma};
}

/// x in [low, high] with tail(x) ≤ target, short of the smallest by 1e-6 of the target at most;
/// tail(high) ≤ target must hold. Newton's steps on the logarithm, which is nearly a parabola,
/// inside a bracket.
template <class Tail>
[[nodiscard]] double tail_root(const Tail& tail, double target, double low, double high) noexcept {
  double x = low;
  for (int step = 0; step < 100; ++step) {
    const TailValue value = tail(x);
    if (value.probability <= target) {
      high = x;
      if (value.probability >= target * (1.0 - 1e-6) || x == low) break;
    } else {
      low = x;
    }
    if (high - low <= 1e-12 * std::abs(high)) break;
    const double next =
        x + value.probability / value.density * (std::log(value.probability / target) + 3e-7);
    x = next > low && next < high ? next : 0.5 * (low + high);
  }
  return high;
}

}  // namespace surefix::raim
