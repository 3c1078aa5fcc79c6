// Loops over the components of a state, unrolled at compile time where the size is fixed and small.
//
// The recursion of a two-state system is a chain of a few dozen dependent operations. It runs at
// the speed of hand-written scalars only if the compiler sees every index as a constant before it
// decides what lives in registers; a belief that goes through memory between two operations costs
// more than the arithmetic.
#pragma once

#include <Eigen/Core>
#include <utility>

#if defined(__GNUC__) || defined(__clang__)
#define SUREFIX_INLINE [[gnu::always_inline]] inline
#define SUREFIX_LAMBDA __attribute__((always_inline))
#else
#define SUREFIX_INLINE inline
#define SUREFIX_LAMBDA
#endif

namespace surefix {

template <class F, int... I>
SUREFIX_INLINE void unrolled(F& f, std::integer_sequence<int, I...>) noexcept {
  (f(I), ...);
}

/// f(0), …, f(n − 1). `N` is n where it is known at compile time, Eigen::Dynamic elsewhere.
template <int N, class F>
SUREFIX_INLINE void loop(int n, F&& f) noexcept {
  if constexpr (N != Eigen::Dynamic && N <= 4) {
    unrolled(f, std::make_integer_sequence<int, N>{});
  } else {
    for (int i = 0; i < n; ++i) f(i);
  }
}

}  // namespace surefix
