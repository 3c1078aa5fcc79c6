// One Gaussian for several: their mean, and their covariance with the spread of the means, which
// the paper's (7) and (18) do not name.
#pragma once

#include "surefix/core/gaussian.hpp"
#include "surefix/core/lane.hpp"
#include "surefix/switching/sizes.hpp"

namespace surefix::switching {

/// Gaussians of one size, as `mix` reads them.
template <class Bank>
struct SameStates {
  const Bank& bank;

  [[nodiscard]] SUREFIX_INLINE const auto& x(int i, int a) const noexcept {
    return bank[at(i)].x(a);
  }
  [[nodiscard]] SUREFIX_INLINE const auto& P(int i, int a, int b) const noexcept {
    return bank[at(i)].P(a, b);
  }
};

/// A term of a sum: as it is where the states are the bank's own, so that it may be added in one
/// pass; else its value, because the states that it was made of are gone.
template <int N, class Lane, class Expression>
[[nodiscard]] SUREFIX_INLINE auto term(const Expression& expression) noexcept {
  if constexpr (N == Eigen::Dynamic) {
    return Lane(expression);
  } else {
    return expression;
  }
}

/// `out`, of the right size, ← mean and covariance of M Gaussians with weights weight(i) that sum
/// to one.
template <int M, class Source, class Weight, class G>
SUREFIX_INLINE void mix(const Source& source, int count, Weight&& weight, G& out) noexcept {
  constexpr int N = G::fixed_size;
  using Lane = typename G::Scalar;
  const int n = out.size();
  loop<N>(n, [&](int a) SUREFIX_LAMBDA {
    out.x(a) = sum_of<M, Lane>(
        count, [&](int i) SUREFIX_LAMBDA { return term<N, Lane>(weight(i) * source.x(i, a)); });
  });
  loop<N>(n, [&](int b) SUREFIX_LAMBDA {
    loop<N>(n, [&](int a) SUREFIX_LAMBDA {
      if (a > b) return;
      out.P(a, b) = sum_of<M, Lane>(count, [&](int i) SUREFIX_LAMBDA {
        return term<N, Lane>(weight(i) * (source.P(i, a, b) + (source.x(i, a) - out.x(a)) *
                                                                  (source.x(i, b) - out.x(b))));
      });
    });
  });
  mirror(out.P);
}

}  // namespace surefix::switching
