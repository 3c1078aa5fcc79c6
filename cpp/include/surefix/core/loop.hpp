// Loops over the components of a state, unrolled at compile time where the size is fixed and small.
//
// The recursion of a two-state system is a chain of a few dozen dependent operations. It runs at
// the speed of hand-written scalars only if the compiler sees every index as a constant before it
// decides what lives in registers; a belief that goes through memory between two operations costs
// more than the arithmetic.
#pragma once

#include <Eigen/Core>
#include <utility>

// Under a sanitizer speed does not matter, and GCC chokes on its checks inlined into one function.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SUREFIX_INLINE inline
#define SUREFIX_LAMBDA
#elif defined(__GNUC__) || defined(__clang__)
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

template <class Lane, class F, int... I>
SUREFIX_INLINE Lane unrolled_sum(F& f, std::integer_sequence<int, I...>) noexcept {
  return (... + f(I));
}

/// f(0) + … + f(n − 1), n ≥ 1, from the left; `N` as in `loop`. Of packs the terms may be Eigen's
/// expressions of what lives as long as the sum: where n is small and known they are added in one
/// pass.
template <int N, class Lane, class F>
[[nodiscard]] SUREFIX_INLINE Lane sum_of(int n, F&& f) noexcept {
  if constexpr (N != Eigen::Dynamic && N <= 4) {
    return unrolled_sum<Lane>(f, std::make_integer_sequence<int, N>{});
  } else {
    Lane sum = f(0);
    for (int i = 1; i < n; ++i) sum += f(i);
    return sum;
  }
}

}  // namespace surefix
