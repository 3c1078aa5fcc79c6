// Fault detection with linear nuisance parameters (Lacresse, Grall & Nikiforov 2005, section 3).
//
//   Y = H X + ε [+ M θ],   ε ~ N(0, L Lᵀ)
//
// X is unknown and wanted by nobody. Whitened by L⁻¹, Y is projected on the orthogonal complement
// of H's columns (parity space) and there on the columns of M: what is left has no X in it, is
// N(0, I) with no fault, and its square Λ is the invariant UBCP test's statistic (4).
// Everything that allocates happens in `make`.
#pragma once

#include <Eigen/Core>

#include "surefix/core/status.hpp"

namespace surefix::raim {

/// H (n × m) and M (n × p) may be of any rank. A direction counts as lost when less than 1e-10 of
/// it is left.
class LinearTest {
 public:
  /// L (n × n): lower triangular, positive diagonal. M without columns stands for the identity: a
  /// fault may be anywhere. `wrong_size`, `not_finite`, `not_positive` (L) leave `out` as it was.
  [[nodiscard]] static ConfigStatus make(const Eigen::MatrixXd& H, const Eigen::MatrixXd& M,
                                         const Eigen::MatrixXd& L, LinearTest& out);

  /// n.
  [[nodiscard]] int size() const noexcept { return static_cast<int>(projection_.cols()); }
  /// q = rank H.
  [[nodiscard]] int rank() const noexcept { return size() - static_cast<int>(W_.rows()); }
  /// Degrees of freedom of Λ: the rank of W L⁻¹ M, n − q when M is the identity.
  [[nodiscard]] int degrees() const noexcept { return static_cast<int>(projection_.rows()); }
  /// W (n − q × n) of the whitened problem: W L⁻¹ H = 0, W Wᵀ = I.
  [[nodiscard]] const Eigen::MatrixXd& W() const noexcept { return W_; }
  /// L⁻¹ (n × n).
  [[nodiscard]] const Eigen::MatrixXd& whitening() const noexcept { return whitening_; }

  /// Λ of y (n), or the noncentrality that a bias y gives it.
  [[nodiscard]] double statistic(const double* y) const noexcept;
  /// Z = W L⁻¹ y (n − q).
  void parity(const double* y, double* z) const noexcept;

 private:
  Eigen::MatrixXd whitening_;
  Eigen::MatrixXd W_;
  Eigen::MatrixXd parity_;      // W L⁻¹
  Eigen::MatrixXd projection_;  // (degrees × n): Λ = ‖projection y‖²
};

}  // namespace surefix::raim
