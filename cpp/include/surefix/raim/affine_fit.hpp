// An affine model of a non-linear nuisance on a compact set (Lacresse, Grall & Nikiforov 2005,
// eqs. 8-10): h_i(X) ≈ a_iᵀX + b_i, from samples of h.
#pragma once

#include <Eigen/Core>

namespace surefix::raim {

struct AffineFit {
  Eigen::MatrixXd A;    ///< (n × m), rows a_i
  Eigen::VectorXd B;    ///< (n)
  Eigen::VectorXd rho;  ///< (n): max |h_i − a_iᵀX − b_i| over the samples (10)
};

/// By least squares (9). X (k × m), values (k × n), k ≥ m + 2.
[[nodiscard]] AffineFit fit_least_squares(const Eigen::MatrixXd& X, const Eigen::MatrixXd& values);

/// By the smallest largest error (8): a linear program for each component, solved by exchanging
/// one of the m + 2 samples at which the error is largest and of alternating sign. No component is
/// ever worse than by least squares.
[[nodiscard]] AffineFit fit_minimax(const Eigen::MatrixXd& X, const Eigen::MatrixXd& values);

}  // namespace surefix::raim
