// n = 2 written out in scalars: the same arithmetic, in the same order, as the
// loops of (a), (b1 lower), (b3) and (b4).  With the loops GCC 12 keeps P in
// memory, and store-to-load forwarding joins the chain of dependent operations
// that a filter's speed is made of; written out, P stays in registers.
#pragma once
#include <limits>

#include "model.hpp"

enum class Written { plain, lower, symmetric, inflated };

template <Written form>
struct TwoState {
  double x[2] = {0, 0};
  double p00 = 0, p01 = 0, p11 = 0;

  void predict(const Transition<2>& f) {
    const double dt = f.dt, q = f.q2 * dt, q01 = q * dt * 0.5, q00 = q01 * dt * (2. / 3);
    x[0] += dt * x[1];
    p00 = (p00 + q00) + ((dt + dt) * p01 + (dt * dt) * p11);
    p01 = (p01 + q01) + dt * p11;
    p11 += q;
  }

  void update(const Vector<double, 2>& h, double r, double z) {
    const double b0 = h[0] * p00 + h[1] * p01;
    const double b1 = h[0] * p01 + h[1] * p11;
    const double inverse = 1 / (h[0] * b0 + h[1] * b1 + r);
    const double k0 = b0 * inverse, k1 = b1 * inverse;
    const double innovation = z - (h[0] * x[0] + h[1] * x[1]);
    x[0] += k0 * innovation;
    x[1] += k1 * innovation;

    if constexpr (form == Written::inflated) {
      constexpr double raise = 1 + 4 * std::numeric_limits<double>::epsilon();
      p00 *= raise;
      p11 *= raise;
    }
    p00 -= (b0 * b0) * inverse;
    p01 -= (b0 * b1) * inverse;
    p11 -= (b1 * b1) * inverse;
    if constexpr (form == Written::plain) return;

    const double m0 = h[0] * p00 + h[1] * p01, e0 = m0 - r * k0;
    const double m1 = h[0] * p01 + h[1] * p11, e1 = m1 - r * k1;
    if constexpr (form == Written::lower) {
      p00 -= e0 * k0;
      p01 -= e1 * k0;
      p11 -= e1 * k1;
    } else {
      const double he = (h[0] * m0 + h[1] * m1) - r * (h[0] * k0 + h[1] * k1);
      p00 = (p00 - (e0 * k0 + k0 * e0)) + he * (k0 * k0);
      p01 = (p01 - (e0 * k1 + k0 * e1)) + he * (k0 * k1);
      p11 = (p11 - (e1 * k1 + k1 * e1)) + he * (k1 * k1);
    }
  }

  double variance(int i) const { return i == 0 ? p00 : p11; }
  Matrix<double, 2> covariance() const { return {{{p00, p01}, {p01, p11}}}; }
  void start(const Matrix<double, 2>&, const Vector<double, 2>& D) { p00 = D[0], p11 = D[1]; }
};
