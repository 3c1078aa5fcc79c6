// Whether a matrix is a covariance; asked of a configuration, before the first step.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "surefix/core/status.hpp"

namespace surefix {

/// Whether no direction of a finite and symmetric S has a negative variance: Cholesky with pivoting
/// on its correlations, so that units do not matter. Of a unit variance 1e-12 n is rounding.
template <class Matrix>
[[nodiscard]] bool is_semidefinite(const Matrix& S) noexcept {
  const int n = static_cast<int>(S.rows());
  const double rounding = 1e-12 * n;
  Matrix C = S;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double scale = std::sqrt(S(i, i)) * std::sqrt(S(j, j));
      if (scale > 0.0) C(i, j) /= scale;
      // A negative variance makes the scale NaN; a variance of zero has no covariances.
      if (!(scale > 0.0) && S(i, j) != 0.0) return false;
    }
  for (int k = 0; k < n; ++k) {
    int p = 0;
    for (int i = 1; i < n; ++i)
      if (C(i, i) > C(p, p)) p = i;
    if (!(C(p, p) > rounding)) break;
    const Eigen::Matrix<double, Matrix::RowsAtCompileTime, 1, 0, Matrix::MaxRowsAtCompileTime, 1>
        b = C.col(p);
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) C(i, j) -= b(i) * b(j) / b(p);
  }
  return (C.array().abs() <= rounding).all();
}

/// ok if S is square, finite, exactly symmetric and positive semidefinite.
template <class Matrix>
[[nodiscard]] ConfigStatus check_covariance(const Matrix& S) noexcept {
  if (S.rows() != S.cols()) return ConfigStatus::wrong_size;
  if (!S.allFinite()) return ConfigStatus::not_finite;
  const bool symmetric = (S.array() == S.transpose().array()).all();
  return symmetric && is_semidefinite(S) ? ConfigStatus::ok : ConfigStatus::not_semidefinite;
}

}  // namespace surefix
