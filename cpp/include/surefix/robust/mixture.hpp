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
  double sum = 0.0;
  for (std::size_t c = 0; c < mixture.count(); ++c)
    sum += std::exp(mixture.log_weight(c) - largest);
  const double total = largest + std::log(sum);
  for (std::size_t c = 0; c < mixture.count(); ++c) mixture.log_weight(c) -= total;
  return total;
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

/// Index of the component with the largest weight, the first of equals.
[[nodiscard]] inline std::size_t heaviest(const Components& mixture) noexcept {
  std::size_t best = 0;
  for (std::size_t c = 1; c < mixture.count(); ++c)
    if (mixture.log_weight(c) > mixture.log_weight(best)) best = c;
  return best;
}

}  // namespace surefix::robust
