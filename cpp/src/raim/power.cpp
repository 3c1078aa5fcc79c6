#include "surefix/raim/power.hpp"

#include <algorithm>
#include <cmath>

#include "surefix/core/distributions.hpp"

namespace surefix::raim {
namespace {

double square(double x) noexcept { return x * x; }
double nearer(double noncentrality, double bound) noexcept {
  return square(std::max(std::sqrt(noncentrality) - bound, 0.0));
}
double farther(double noncentrality, double bound) noexcept {
  return square(std::sqrt(noncentrality) + bound);
}

/// The largest value of a function with one maximum on [0, end].
template <class F>
double largest(F&& f, double end) noexcept {
  constexpr int steps = 64;
  int best = 0;
  double found = f(0.0);
  for (int i = 1; i <= steps; ++i) {
    const double value = f(end * i / steps);
    if (value > found) best = i, found = value;
  }
  double low = end * std::max(best - 1, 0) / steps, high = end * std::min(best + 1, steps) / steps;
  for (int i = 0; i < 50; ++i) {  // golden section
    const double step = 0.38196601125010515 * (high - low), a = low + step, b = high - step;
    const double at_a = f(a), at_b = f(b);
    found = std::max({found, at_a, at_b});
    (at_a < at_b ? low : high) = at_a < at_b ? a : b;
  }
  return found;
}

}  // namespace

double ChiSquaredTest::power(double noncentrality) const noexcept {
  return noncentral_chi_squared_tail(threshold, degrees, noncentrality);
}
double ChiSquaredTest::missed(double noncentrality) const noexcept {
  return noncentral_chi_squared_cdf(threshold, degrees, noncentrality);
}
double ChiSquaredTest::least_power(double noncentrality, double bound) const noexcept {
  return power(nearer(noncentrality, bound));
}
double ChiSquaredTest::most_missed(double noncentrality, double bound) const noexcept {
  return missed(nearer(noncentrality, bound));
}
double ChiSquaredTest::most_power(double noncentrality, double bound) const noexcept {
  return power(farther(noncentrality, bound));
}
double ChiSquaredTest::loss(double noncentrality, double bound) const noexcept {
  // The smaller of the two ways to write it keeps its digits.
  const double seen = power(noncentrality);
  if (seen < 0.5) return std::max(seen - least_power(noncentrality, bound), 0.0);
  return std::max(most_missed(noncentrality, bound) - missed(noncentrality), 0.0);
}
double ChiSquaredTest::gain(double noncentrality, double bound) const noexcept {
  const double seen = power(noncentrality);
  if (seen < 0.5) return std::max(most_power(noncentrality, bound) - seen, 0.0);
  return std::max(missed(noncentrality) - missed(farther(noncentrality, bound)), 0.0);
}
double ChiSquaredTest::worst_loss(double bound) const noexcept {
  return largest([&](double t) { return loss(t * t, bound); }, std::sqrt(threshold) + 9.0 + bound);
}
double ChiSquaredTest::worst_gain(double bound) const noexcept {
  return largest([&](double t) { return gain(t * t, bound); }, std::sqrt(threshold) + 9.0);
}

ChiSquaredTest chi_squared_test(double false_alarm, double degrees) noexcept {
  return {degrees, chi_squared_threshold(false_alarm, degrees)};
}

}  // namespace surefix::raim
