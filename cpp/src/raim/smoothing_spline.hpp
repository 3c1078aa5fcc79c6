// Natural cubic splines through points, or as smooth as wanted beside them (Reinsch's algorithm).
#pragma once

#include <Eigen/Core>

namespace surefix::raim {

/// Values and second derivatives (k × columns) at the knots; the latter are 0 at both ends and
/// linear in between.
struct Spline {
  Eigen::MatrixXd value, bend;
};

/// The g with the least Σ w_i |y_i − g(t_i)|² + stiffness ∫|g''|², w_i the length for which t_i
/// stands. t (k ≥ 2) increasing, y (k × columns). Time and memory linear in k.
[[nodiscard]] inline Spline smoothing_spline(const Eigen::VectorXd& t, const Eigen::MatrixXd& y,
                                             double stiffness) {
  const Eigen::Index k = t.size(), n = k - 2;
  Spline out{y, Eigen::MatrixXd::Zero(k, y.cols())};
  if (n < 1) return out;
  const Eigen::VectorXd h = t.tail(k - 1) - t.head(k - 1);
  Eigen::VectorXd w(k);
  for (Eigen::Index i = 0; i < k; ++i)
    w(i) = 0.5 * ((i > 0 ? h(i - 1) : 0.0) + (i < k - 1 ? h(i) : 0.0));

  // (R + stiffness Qᵀ W⁻¹ Q) γ = Qᵀ y for the bends γ at the inner knots. Column j of Q holds
  // 1/h_j, −1/h_j − 1/h_{j+1}, 1/h_{j+1} in rows j … j + 2. The matrix has five diagonals, of
  // which d0, d1, d2 are kept.
  const auto q = [&](Eigen::Index row, Eigen::Index j) {  // of those
    if (row == j) return 1.0 / h(j);
    if (row == j + 1) return -1.0 / h(j) - 1.0 / h(j + 1);
    return 1.0 / h(j + 1);
  };
  const auto penalty = [&](Eigen::Index i, Eigen::Index j) {  // (Qᵀ W⁻¹ Q)_ij, i ≤ j
    double sum = 0.0;
    for (Eigen::Index row = j; row <= i + 2; ++row) sum += q(row, i) * q(row, j) / w(row);
    return stiffness * sum;
  };
  Eigen::VectorXd d0(n), d1 = Eigen::VectorXd::Zero(n), d2 = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd gamma(n, y.cols());
  for (Eigen::Index j = 0; j < n; ++j) {
    d0(j) = (h(j) + h(j + 1)) / 3.0 + penalty(j, j);
    if (j + 1 < n) d1(j) = h(j + 1) / 6.0 + penalty(j, j + 1);
    if (j + 2 < n) d2(j) = penalty(j, j + 2);
    gamma.row(j) = (y.row(j + 2) - y.row(j + 1)) / h(j + 1) - (y.row(j + 1) - y.row(j)) / h(j);
  }
  // L D Lᵀ in place: d1 and d2 become the subdiagonals of L.
  for (Eigen::Index j = 0; j < n; ++j) {
    if (j + 1 < n) {
      const double l1 = d1(j) / d0(j), l2 = d2(j) / d0(j);
      d0(j + 1) -= l1 * d1(j);
      gamma.row(j + 1) -= l1 * gamma.row(j);
      if (j + 2 < n) {
        d1(j + 1) -= l1 * d2(j);
        d0(j + 2) -= l2 * d2(j);
        gamma.row(j + 2) -= l2 * gamma.row(j);
      }
      d1(j) = l1;
      d2(j) = l2;
    }
  }
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    gamma.row(j) /= d0(j);
    if (j + 1 < n) gamma.row(j) -= d1(j) * gamma.row(j + 1);
    if (j + 2 < n) gamma.row(j) -= d2(j) * gamma.row(j + 2);
  }
  out.bend.middleRows(1, n) = gamma;
  if (stiffness > 0.0)  // g = y − stiffness W⁻¹ Q γ
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index row = j; row <= j + 2; ++row)
        out.value.row(row) -= stiffness * q(row, j) / w(row) * gamma.row(j);
  return out;
}

}  // namespace surefix::raim
