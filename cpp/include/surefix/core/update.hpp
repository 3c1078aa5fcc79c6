// The one primitive: the update of a belief by one scalar measurement.
#pragma once

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
/// The covariance is Joseph's (I − k h) P (I − k h)ᵀ + r k kᵀ in O(n²): with M = P − k bᵀ, b = P hᵀ,
/// and e = M hᵀ − r k, which is zero but for rounding,
///   P⁺ = M − e kᵀ − k eᵀ + (h e) k kᵀ.
/// The last terms damp the rounding of M from both sides; that is what keeps P ≥ 0. Measured
/// against five other forms in benchmarks/covariance_forms.
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
    loop<N>(n, [&](int i) SUREFIX_LAMBDA {
      if (i <= j) belief.P(i, j) -= k(i) * b(j);
    });
  });
  mirror(belief.P);
  typename G::Vector e = h.times(belief);  // M hᵀ
  loop<N>(n, [&](int i) SUREFIX_LAMBDA { e(i) -= r * k(i); });
  const Lane he = h.dot(e);
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    loop<N>(n, [&](int i) SUREFIX_LAMBDA {
      if (i <= j) belief.P(i, j) -= e(j) * k(i) + (e(i) * k(j) - he * k(i) * k(j));
    });
  });
  mirror(belief.P);
  return true;
}

}  // namespace surefix
