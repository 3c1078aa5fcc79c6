// The composite step (Bilenne 2004, table 1, corrected): one update for all the measurements
// between two estimation times. Two ways to the same numbers:
//   composite   all at once, for any symmetric positive definite Υ
//   sequential  the fast way, for block diagonal Υ: one scalar update for each component
// For analysis and as the foundation of fault hypotheses; it allocates. Onboard: `filter.hpp`.
#pragma once

#include "surefix/core/status.hpp"
#include "surefix/desync/composite_matrices.hpp"

namespace surefix::desync {

/// What a composite step gives.
struct StepUpdate {
  Eigen::VectorXd x;               ///< n
  Eigen::MatrixXd P;               ///< n × n
  Eigen::VectorXd innovation;      ///< γ, M (17)
  Eigen::VectorXd noise;           ///< v̂ = Υ Γ⁻¹ γ, M (25)
  Eigen::VectorXd noise_variance;  ///< diagonal of Υ Γ⁻¹ Υ, M (26)
  double sse;                      ///< γᵀ Γ⁻¹ γ (27), χ² with M degrees of freedom
  double log_likelihood;           ///< log N(γ; 0, Γ)
};

class CompositeStep {
 public:
  /// `legs`: N + 1, `observations`: N ≥ 0; the last leg leads to the estimation time.
  CompositeStep(std::vector<Leg> legs, std::vector<Observation> observations);
  /// With any symmetric positive definite Υ (M × M) instead of the observations' own R.
  CompositeStep(std::vector<Leg> legs, std::vector<Observation> observations,
                const Eigen::MatrixXd& Upsilon);

  [[nodiscard]] const CompositeMatrices& matrices() const noexcept { return matrices_; }
  [[nodiscard]] bool backward(BackwardMatrices& out) const {
    return backward_matrices(legs_, observations_, matrices_, out);
  }
  /// Whether Υ is block diagonal by observation, so that the fast way exists.
  [[nodiscard]] bool separable() const noexcept { return separable_; }

  /// Γ = HF P HFᵀ + L Ω Lᵀ + Υ and C = F P HFᵀ + W Ω Lᵀ = cov(x_k, γ).
  [[nodiscard]] Eigen::MatrixXd Gamma(const Eigen::MatrixXd& P) const;
  [[nodiscard]] Eigen::MatrixXd cross_covariance(const Eigen::MatrixXd& P) const;

  /// From x (n), P (n × n), the measurements z (M) and inputs u (p(N+1)). `numerical`, with `out`
  /// undefined, if a covariance is not positive (semi)definite.
  [[nodiscard]] Status composite(const Eigen::VectorXd& x, const Eigen::MatrixXd& P,
                                 const Eigen::VectorXd& z, const Eigen::VectorXd& u,
                                 StepUpdate& out) const;
  /// The same numbers for a separable step, in O(M n² + N n³).
  [[nodiscard]] Status sequential(const Eigen::VectorXd& x, const Eigen::MatrixXd& P,
                                  const Eigen::VectorXd& z, const Eigen::VectorXd& u,
                                  StepUpdate& out) const;

 private:
  std::vector<Leg> legs_;
  std::vector<Observation> observations_;
  CompositeMatrices matrices_;
  bool separable_;
};

}  // namespace surefix::desync
