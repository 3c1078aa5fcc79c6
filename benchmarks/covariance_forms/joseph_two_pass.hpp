// (b1, b2)  Joseph's form (Bucy & Joseph 1968) as two rank-one passes, O(n^2):
//
//     M  = P - k b'                 = (I - k h) P
//     P+ = M - (M h' - r k) k'      = M (I - k h)' + r k k'
//
// The second pass multiplies the rounding of M by (I - k h)' from the RIGHT
// only.  So the two triangles of the computed P+ are not equally good: entry
// (i, j) is clean where h measures component j, and keeps an error of size
// eps * P[i][j] where h measures component i.  Which triangle to keep therefore
// depends on h; averaging keeps half the error of the worse one.
#pragma once
#include "covariance.hpp"

enum class Keep { upper, lower, average };

template <class T, int n, Keep keep>
struct JosephTwoPass : Covariance<T, n> {
  void update(const Vector<double, n>& h, double r, double z) {
    const auto g = this->correct_state(h, r, z);
    this->subtract_outer(g);
    const Matrix<T, n> M = this->P;
    const Vector<T, n>& k = g.k;

    Vector<T, n> e;  // M h' - r k: zero but for rounding
    for (int i = 0; i < n; ++i) e[i] = dot<T, n>(h, M[i]) - r * k[i];

    for (int i = 0; i < n; ++i)
      for (int j = i; j < n; ++j) {
        if constexpr (keep == Keep::upper)
          this->P[i][j] = M[i][j] - e[i] * k[j];
        else if constexpr (keep == Keep::lower)
          this->P[i][j] = M[i][j] - e[j] * k[i];
        else
          this->P[i][j] = M[i][j] - T(0.5) * (e[i] * k[j] + e[j] * k[i]);
      }
    this->mirror();
  }
};
