// A transition with F and Q as matrices, for models whose size is known at run time. Plain loops:
// on these sizes they are several times faster than products of bounded-dynamic matrices.
#pragma once

#include <type_traits>

#include "surefix/core/gaussian.hpp"

namespace surefix {

/// What a transition by a matrix F does to columns. `Matrix`: one of its own, or a view of one.
template <int N, int MaxN, class Matrix>
struct MatrixTransition {
  /// As many components of V's scalar, a double or a pack.
  template <class V>
  using Column = typename Gaussian<N, typename std::decay_t<V>::Scalar, MaxN>::Vector;

  Matrix F;

  template <class V>
  SUREFIX_INLINE void apply(V&& v) const noexcept {
    if constexpr (N == 1) {
      v(0) = F(0, 0) * v(0);
    } else {
      multiply(v);
    }
  }

  template <class V>
  void apply_transposed(V&& v) const noexcept {
    const int n = static_cast<int>(F.rows());
    Column<V> result(n);
    for (int j = 0; j < n; ++j) {
      result(j) = F(0, j) * v(0);
      for (int i = 1; i < n; ++i) result(j) += F(i, j) * v(i);
    }
    for (int i = 0; i < n; ++i) v(i) = result(i);
  }

 private:
  template <class V>
  void multiply(V& v) const noexcept {
    const int n = static_cast<int>(F.rows());
    Column<V> result(n);
    for (int i = 0; i < n; ++i) result(i) = F(i, 0) * v(0);
    for (int j = 1; j < n; ++j)
      for (int i = 0; i < n; ++i) result(i) += F(i, j) * v(j);
    for (int i = 0; i < n; ++i) v(i) = result(i);
  }
};

/// F (n × n) and Q (n × n, symmetric) of one duration; `StoredN`: room for them in it, or
/// Eigen::Dynamic for room on the heap, as large as they are.
template <int N, int MaxN = N, int StoredN = MaxN>
struct DenseTransition : MatrixTransition<N, MaxN, typename Gaussian<N, double, StoredN>::Matrix> {
  using Matrix = typename Gaussian<N, double, StoredN>::Matrix;

  Matrix Q;

  template <class M>
  void add_noise(M& P) const noexcept {
    const int n = static_cast<int>(Q.rows());
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) P(i, j) += Q(i, j);
  }
};

}  // namespace surefix
