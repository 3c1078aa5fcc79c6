// The composite step's matrices (Bilenne 2004, app. A.1, eqs. 35-47), with the paper's misprints
// corrected: H̄ and Θ̄ need inverses, J is block diagonal, J̃ = J − Ξ.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace surefix::desync {

/// One leg between two times: x ← F x + G u + ω, cov(ω) = Q.
struct Leg {
  Eigen::MatrixXd F;  ///< n × n, may be singular
  Eigen::MatrixXd Q;  ///< n × n, symmetric positive semidefinite
  Eigen::MatrixXd G;  ///< n × p; no columns where there is no input
};

/// One observation at the end of its leg: y = H x + J u + v, cov(v) = R.
struct Observation {
  Eigen::MatrixXd H;  ///< m × n
  Eigen::MatrixXd R;  ///< m × m, symmetric positive definite
  Eigen::MatrixXd J;  ///< m × p
};

/// The matrices of a step of N observations and N + 1 legs; M is the number of components of all
/// observations together, p the number of inputs of a leg.
struct CompositeMatrices {
  Eigen::MatrixXd F;        ///< n × n                 (41)
  Eigen::MatrixXd G;        ///< n × p(N+1)            (42)
  Eigen::MatrixXd W;        ///< n × n(N+1)            (43)
  Eigen::MatrixXd Omega;    ///< n(N+1) × n(N+1)       (39)
  Eigen::MatrixXd Upsilon;  ///< M × M                 (37)
  Eigen::MatrixXd J;        ///< M × p(N+1), block diagonal (46)
  /// The inverse-free pair, right for singular F too: z = HF x_{k−1} + L ω + (L Ḡ + J) u + v.
  Eigen::MatrixXd HF;  ///< M × n       HF_i = H_i F_i…F_1           (the paper's H F)
  Eigen::MatrixXd L;   ///< M × n(N+1)  L_ij = H_i F_i…F_{j+1}, j ≤ i (the paper's H W − Θ)
  Eigen::MatrixXd LG;  ///< M × p(N+1)  L_ij G_j                     (the paper's H G − Ξ)
};

/// The paper's own backward-looking matrices, which exist only if F_{N+1}…F_2 are invertible.
struct BackwardMatrices {
  Eigen::MatrixXd H;       ///< M × n       H̄_i = H_i (F_{N+1}…F_{i+1})⁻¹      (44)
  Eigen::MatrixXd Theta;   ///< M × n(N+1)  Θ̄_ij = H_i (F_j…F_{i+1})⁻¹, j > i  (45)
  Eigen::MatrixXd Xi;      ///< M × p(N+1)  Ξ̄_ij = Θ̄_ij G_j                   (47)
  Eigen::MatrixXd Jtilde;  ///< M × p(N+1)  J − Ξ                              (46)
};

/// Sizes must fit: `legs` has one more than `observations`, all of n states and p inputs.
[[nodiscard]] CompositeMatrices composite_matrices(const std::vector<Leg>& legs,
                                                   const std::vector<Observation>& observations);

/// False if an F after the first observation is singular to working precision.
[[nodiscard]] bool backward_matrices(const std::vector<Leg>& legs,
                                     const std::vector<Observation>& observations,
                                     const CompositeMatrices& matrices, BackwardMatrices& out);

}  // namespace surefix::desync
