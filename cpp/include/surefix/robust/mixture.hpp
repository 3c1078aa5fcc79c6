// The mixture that the hypotheses of a step make (Bilenne 2004, eqs. 28-32).
#pragma once

#include <cmath>

#include "surefix/robust/components.hpp"
#include "surefix/robust/mode_table.hpp"

namespace surefix::robust {

/// Scales the weights to sum to one, in the log domain: returns log Σ exp(log_weight), −∞ if no
/// component has any weight.
[[nodiscard]] inline double normalise(Components& mixture) noexcept {
  double largest = -std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < mixture.count(); ++c)
    largest = std::max(largest, mixture.log_weight(c));
  if (!(largest > -std::numeric_limits<double>::infinity())) return largest;
  double sum = 0.0;  // in two steps: a weight of e^−1e16 keeps no digits of log Σ
  for (std::size_t c = 0; c < mixture.count(); ++c)
    sum += std::exp(mixture.log_weight(c) -= largest);
  const double rest = std::log(sum);
  for (std::size_t c = 0; c < mixture.count(); ++c) mixture.log_weight(c) -= rest;
  return largest + rest;
}

/// Mean (n) and covariance (n × n, column by column) of the first n states (eqs. 30-32).
inline void moments(const Components& mixture, int n, double* x, double* P) noexcept {
  std::fill(x, x + n, 0.0);
  std::fill(P, P + n * n, 0.0);
  const int m = mixture.state_size();
  for (std::size_t c = 0; c < mixture.count(); ++c) {
    const double weight = std::exp(mixture.log_weight(c));
    if (weight == 0.0) continue;  // nor may it bring an overflow in
    for (int i = 0; i < n; ++i) x[i] += weight * mixture.x(c)[i];
  }
  for (std::size_t c = 0; c < mixture.count(); ++c) {
    const double weight = std::exp(mixture.log_weight(c));
    if (weight == 0.0) continue;
    for (int j = 0; j < n; ++j) {
      const double dj = mixture.x(c)[j] - x[j];
      for (int i = 0; i < n; ++i)
        P[j * n + i] += weight * (mixture.P(c)[j * m + i] + (mixture.x(c)[i] - x[i]) * dj);
    }
  }
}

/// Posterior probability of every mode of every sensor: out (sensors, max_modes).
inline void mode_probabilities(const Components& mixture, const ModeTable& table,
                               double* out) noexcept {
  std::fill(out, out + table.sensors() * SensorModes::max_modes, 0.0);
  for (std::size_t c = 0; c < mixture.count(); ++c) {
    const double weight = std::exp(mixture.log_weight(c));
    for (int s = 0; s < table.sensors(); ++s)
      out[s * SensorModes::max_modes + table.mode(mixture.hypothesis(c), s)] += weight;
  }
}

/// The most probable hypothesis, whatever the histories that lead to it: the index of the heaviest
/// of its components. `mass`: scratch for every hypothesis of the table.
[[nodiscard]] inline std::size_t most_probable(const Components& mixture,
                                               std::vector<double>& mass) noexcept {
  std::fill(mass.begin(), mass.end(), 0.0);
  const auto of = [&](std::size_t c) { return static_cast<std::size_t>(mixture.hypothesis(c)); };
  for (std::size_t c = 0; c < mixture.count(); ++c) mass[of(c)] += std::exp(mixture.log_weight(c));
  std::size_t best = 0;
  for (std::size_t c = 1; c < mixture.count(); ++c) {
    const double more = mass[of(c)] - mass[of(best)];
    const bool heavier = mixture.log_weight(c) > mixture.log_weight(best);
    if (more > 0.0 || (of(c) == of(best) && heavier)) best = c;
  }
  return best;
}

}  // namespace surefix::robust
