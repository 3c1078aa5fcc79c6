// The prediction of a belief over a transition (Bilenne 2004, eq. 13; table 1).
//
// A transition knows how to do three things to columns of the state's size; nobody multiplies by
// the zeros and ones of F:
//   apply(v)             v ← F v
//   apply_transposed(v)  v ← Fᵀ v
//   add_noise(P)         P ← P + Q
#pragma once

#include "surefix/core/gaussian.hpp"

namespace surefix {

/// P ← F P Fᵀ: F on every column, then F on every row; the upper triangle rules.
template <class Matrix, class Transition>
SUREFIX_INLINE void propagate(Matrix& P, const Transition& transition) noexcept {
  constexpr int N = Matrix::RowsAtCompileTime;
  const int n = static_cast<int>(P.rows());
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    auto column = P.col(j);
    transition.apply(column);
  });
  loop<N>(n, [&](int i) SUREFIX_LAMBDA {
    auto row = P.row(i);
    transition.apply(row);
  });
  mirror(P);
}

/// Λ ← Fᵀ Λ F, the same for a matrix that is swept back in time.
template <class Matrix, class Transition>
SUREFIX_INLINE void propagate_transposed(Matrix& Lambda, const Transition& transition) noexcept {
  constexpr int N = Matrix::RowsAtCompileTime;
  const int n = static_cast<int>(Lambda.rows());
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    auto column = Lambda.col(j);
    transition.apply_transposed(column);
  });
  loop<N>(n, [&](int i) SUREFIX_LAMBDA {
    auto row = Lambda.row(i);
    transition.apply_transposed(row);
  });
  mirror(Lambda);
}

/// x ← F x, P ← F P Fᵀ + Q.
template <class G, class Transition>
SUREFIX_INLINE void predict(G& belief, const Transition& transition) noexcept {
  transition.apply(belief.x);
  propagate(belief.P, transition);
  transition.add_noise(belief.P);
}

}  // namespace surefix
