#pragma once

#include <Eigen/Core>

namespace surefix::desync {

/// log N(γ; 0, Γ) of M components from log det Γ and γᵀΓ⁻¹γ.
inline double log_density(Eigen::Index M, double log_determinant, double sse) {
  constexpr double log_2pi = 1.83787706640934548356;
  return -0.5 * (static_cast<double>(M) * log_2pi + log_determinant + sse);
}

}  // namespace surefix::desync
