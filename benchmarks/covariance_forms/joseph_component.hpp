// (b5)  b3 for a row that reads one component i of the state, h = e_i, in fewer operations:
//
//     P+ h' = r k       exactly, so row and column i need no subtraction at all
//     P+    = M         elsewhere
//
// Row and column i are accurate to a few eps however small r is, and what is left of the rounding
// of M is a few eps of P_jl in the other components, which the measurement does not shrink below
// their part that is independent of component i.  Any other row is updated as in b3.
#pragma once

#include "joseph_symmetric.hpp"

template <class T, int n>
struct JosephComponent : JosephSymmetric<T, n> {
  void update(const Vector<double, n>& h, double r, double z) {
    int measured = -1, entries = 0;
    for (int i = 0; i < n; ++i)
      if (h[i] != 0) measured = i, ++entries;
    if (entries != 1 || h[measured] != 1) return JosephSymmetric<T, n>::update(h, r, z);
    auto& P = this->P;
    const auto g = this->correct_state(h, r, z);
    this->subtract_outer(g);
    for (int i = 0; i < n; ++i) P[i][measured] = P[measured][i] = r * g.k[i];
  }
};
