// A Gaussian belief about the state: a plain value that can be copied, saved and restored.
#pragma once

#include <Eigen/Core>

#include "surefix/core/covariance.hpp"
#include "surefix/core/loop.hpp"

namespace surefix {

/// Mean x (n) and covariance P (n × n, exactly symmetric) of a state of n components.
///
/// `N` is the size, or Eigen::Dynamic with at most `MaxN` components (no heap in either).
/// `Lane` is `double` for one belief, or a pack (`lane.hpp`) for several that share F, h and r.
template <int N, class Lane = double, int MaxN = N>
struct Gaussian {
  static constexpr int fixed_size = N;
  using Scalar = Lane;
  using Vector = Eigen::Matrix<Lane, N, 1, 0, MaxN, 1>;
  using Matrix = Eigen::Matrix<Lane, N, N, 0, MaxN, MaxN>;

  Vector x;
  Matrix P;

  [[nodiscard]] SUREFIX_INLINE int size() const noexcept { return static_cast<int>(x.size()); }

  /// Whether a filter may start from it.
  [[nodiscard]] ConfigStatus check() const noexcept {
    if (P.rows() != x.size()) return ConfigStatus::wrong_size;
    return x.allFinite() ? check_covariance(P) : ConfigStatus::not_finite;
  }
};

/// to ← from, component by component (same size): unlike Eigen's assignment it leaves a small
/// belief in registers.
template <class G>
SUREFIX_INLINE void assign(G& to, const G& from) noexcept {
  constexpr int N = G::fixed_size;
  const int n = from.size();
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    to.x(j) = from.x(j);
    loop<N>(n, [&](int i) SUREFIX_LAMBDA { to.P(i, j) = from.P(i, j); });
  });
}

/// Copies the upper triangle onto the lower one: P leaves every operation exactly symmetric.
template <class Matrix>
SUREFIX_INLINE void mirror(Matrix& P) noexcept {
  constexpr int N = Matrix::RowsAtCompileTime;
  const int n = static_cast<int>(P.rows());
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    loop<N>(n, [&](int i) SUREFIX_LAMBDA {
      if (i < j) P(j, i) = P(i, j);
    });
  });
}

/// True if every mean and every variance is finite. (In a positive semidefinite matrix a finite
/// diagonal bounds the rest.)
template <class G>
[[nodiscard]] SUREFIX_INLINE bool is_finite(const G& belief) noexcept {
  double sum = 0.0;  // a finite number times zero is zero; infinity and NaN give NaN
  loop<G::fixed_size>(belief.size(),
                      [&](int i) SUREFIX_LAMBDA { sum += belief.x(i) + belief.P(i, i); });
  return sum * 0.0 == 0.0;
}

}  // namespace surefix
