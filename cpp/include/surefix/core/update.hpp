// The one primitive: the update of a belief by one scalar measurement.
#pragma once

#include "surefix/core/gaussian.hpp"
#include "surefix/core/lane.hpp"
#include "surefix/core/row.hpp"

namespace surefix {

/// What one scalar measurement brought: innovation ν = z − ẑ, its variance S = h P hᵀ + r with 1/S,
/// and the gain k = P hᵀ / S (n).
template <class G>
struct Innovation {
  typename G::Scalar value;
  typename G::Scalar variance;
  typename G::Scalar inverse;
  typename G::Vector gain;
};

/// P⁺ for a row that reads component I alone. Joseph's form says P⁺hᵀ = r k, so row and column I
/// need no subtraction and are exact to a few ulps, however small r is.
template <int I, class G, class Variance>
SUREFIX_INLINE void correct_component(G& belief, const typename G::Vector& k,
                                      const Variance& r) noexcept {
  loop<G::fixed_size>(belief.size(), [&](int i) SUREFIX_LAMBDA {
    belief.P(i, I) = r * k(i);
    belief.P(I, i) = r * k(i);
  });
}

/// P⁺ for any row, Joseph's (I − k h) P (I − k h)ᵀ + r k kᵀ in O(n²): with e = M hᵀ − r k, which is
/// zero but for the rounding of M,  P⁺ = M − e kᵀ − k eᵀ + (h e) k kᵀ  damps it from both sides.
template <class G, class Row, class Variance>
SUREFIX_INLINE void correct(G& belief, const Row& h, const typename G::Vector& k,
                            const Variance& r) noexcept {
  constexpr int N = G::fixed_size;
  const int n = belief.size();
  typename G::Vector e = h.times(belief);
  loop<N>(n, [&](int i) SUREFIX_LAMBDA { e(i) -= r * k(i); });
  const typename G::Scalar he = h.dot(e);
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    loop<N>(n, [&](int i) SUREFIX_LAMBDA {
      if (i <= j) belief.P(i, j) -= e(j) * k(i) + (e(i) * k(j) - he * k(i) * k(j));
    });
  });
  mirror(belief.P);
}

/// Updates `belief` by a measurement with row h (n), noise variance r (a double, or one for each
/// lane) and innovation ν.
///
/// The covariance is M = P − b bᵀ/S, b = P hᵀ, corrected for its rounding: that is what keeps P ≥ 0
/// (measured against six other forms in benchmarks/covariance_forms).
///
/// False, with `belief` untouched, if S is not positive and finite.
template <class G, class Row, class Variance>
[[nodiscard]] SUREFIX_INLINE bool update(G& belief, const Row& h, const Variance& r,
                                         const typename G::Scalar& innovation,
                                         Innovation<G>& out) noexcept {
  using Lane = typename G::Scalar;
  constexpr int N = G::fixed_size;
  const int n = belief.size();
  const typename G::Vector b = h.times(belief);
  const Lane S = h.dot(b) + r;
  if (!positive(S)) return false;
  const Lane inverse = Lane(1.0) / S;

  out.value = innovation;
  out.variance = S;
  out.inverse = inverse;
  if constexpr (N == 1) {  // P⁺ = P r / S: nothing is subtracted
    out.gain(0) = b(0) * inverse;
    belief.x(0) += out.gain(0) * innovation;
    belief.P(0, 0) = r * (belief.P(0, 0) * inverse);
    return true;
  }
  out.gain = b;
  loop<N>(n, [&](int i) SUREFIX_LAMBDA {
    out.gain(i) = b(i) * inverse;
    belief.x(i) += out.gain(i) * innovation;
  });
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    loop<N>(n, [&](int i) SUREFIX_LAMBDA {
      if (i <= j) belief.P(i, j) -= (b(i) * b(j)) * inverse;
    });
  });
  mirror(belief.P);
  if constexpr (Row::component >= 0) {
    correct_component<Row::component>(belief, out.gain, r);
  } else {
    correct(belief, h, out.gain, r);
  }
  return true;
}

}  // namespace surefix
