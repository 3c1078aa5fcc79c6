// The one primitive: the update of a belief by one scalar measurement.
#pragma once

#include <Eigen/Cholesky>

#include "surefix/core/gaussian.hpp"
#include "surefix/core/lane.hpp"
#include "surefix/core/row.hpp"

namespace surefix {

/// What one scalar measurement brought: innovation ν = z − ẑ, its variance S = h P hᵀ + r, and
/// the gain k = P hᵀ / S (n).
template <class G>
struct Innovation {
  typename G::Scalar value;
  typename G::Scalar variance;
  typename G::Vector gain;
};

/// Updates `belief` by a measurement with row h (n), noise variance r and innovation ν.
///
/// The covariance is Joseph's (I − k h) P (I − k h)ᵀ + r k kᵀ in O(n²): M = P − k (h P), then
/// P⁺ = M − (M hᵀ − r k) kᵀ. The second term is zero in exact arithmetic; it takes out what the
/// rounding of the first left behind, which is what keeps P ≥ 0 (benchmarks/covariance_forms).
///
/// False, with `belief` untouched, if S is not positive and finite.
template <class G, class Row>
[[nodiscard]] SUREFIX_INLINE bool update(G& belief, const Row& h, double r,
                                         const typename G::Scalar& innovation,
                                         Innovation<G>& out) noexcept {
  using Lane = typename G::Scalar;
  constexpr int N = G::fixed_size;
  const int n = belief.size();
  const typename G::Vector b = h.times(belief);
  const Lane S = h.dot(b) + r;
  if (!positive(S)) return false;
  const Lane inverse = 1.0 / S;

  out.value = innovation;
  out.variance = S;
  out.gain = b;
  typename G::Vector& k = out.gain;
  loop<N>(n, [&](int i) SUREFIX_LAMBDA {
    k(i) = b(i) * inverse;
    belief.x(i) += k(i) * innovation;
  });
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    loop<N>(n, [&](int i) SUREFIX_LAMBDA { belief.P(i, j) -= k(i) * b(j); });
  });
  typename G::Vector c = h.times(belief);  // M hᵀ
  loop<N>(n, [&](int i) SUREFIX_LAMBDA { c(i) -= r * k(i); });
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    loop<N>(n, [&](int i) SUREFIX_LAMBDA {
      if (i <= j) belief.P(i, j) -= c(i) * k(j);
    });
  });
  mirror(belief.P);
  return true;
}

}  // namespace surefix
