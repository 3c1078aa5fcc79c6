// (b3)  Joseph's form as a symmetric correction of the plain one, O(n^2):
//
//     M  = P - b b' / S                       the plain form
//     e  = M h' - r k                         how far M misses  P+ h' = r k
//     P+ = M - e k' - k e' + (h e) k k'       upper triangle, mirrored
//
// Exact algebra gives e = 0.  With M = P+ + E, E the symmetric rounding of the
// first pass, e = E h' and the last line is
//
//     P+ + (I - k h) E (I - k h)':
//
// the rounding is damped from BOTH sides, as in the textbook form, and neither
// triangle is special.
//
// (b4)  The same with the diagonal of M raised by  inflate * eps * P_ii.  That
// covers the few eps * sqrt(P_ii P_jj) the first pass can be wrong by, so M
// errs on the definite side; the second pass damps the raise like any other E,
// so a measured component still reaches r, however small.
#pragma once
#include <limits>

#include "covariance.hpp"

template <class T, int n, int inflate = 0>
struct JosephSymmetric : Covariance<T, n> {
  void update(const Vector<double, n>& h, double r, double z) {
    auto& P = this->P;
    const auto g = this->correct_state(h, r, z);
    const Vector<T, n>& k = g.k;
    if constexpr (inflate > 0)
      for (int i = 0; i < n; ++i) P[i][i] *= 1 + inflate * std::numeric_limits<double>::epsilon();
    this->subtract_outer(g);

    Vector<T, n> Mh, e;
    for (int i = 0; i < n; ++i) {
      Mh[i] = dot<T, n>(h, P[i]);
      e[i] = Mh[i] - r * k[i];
    }
    const T he = dot<T, n>(h, Mh) - r * dot<T, n>(h, k);

    for (int i = 0; i < n; ++i)
      for (int j = i; j < n; ++j)
        P[i][j] = (P[i][j] - (e[i] * k[j] + k[i] * e[j])) + he * (k[i] * k[j]);
    this->mirror();
  }
};
