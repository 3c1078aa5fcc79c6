// (d)  P = U D U' kept as its factors between steps; P itself is never formed.
//
// Measurement update: G. J. Bierman, "Factorization Methods for Discrete
// Sequential Estimation", Academic Press 1977, ch. V.  Time update: the weighted
// modified Gram-Schmidt of C. L. Thornton, "Triangular Covariance
// Factorizations for Kalman Filtering", JPL TM 33-798, 1976.
#pragma once
#include "model.hpp"

template <class T, int n>
struct BiermanThornton {
  Vector<T, n> x{};
  Matrix<T, n> U{};  // unit upper triangular
  Vector<T, n> D{};

  // Rows of [F U | G] are orthogonalised in the weights [D | Dq], last to first.
  // F, U and G are upper triangular, so row j starts at column j in both halves.
  void predict(const Transition<n>& t) {
    predict_state<T, n>(x, t);
    const T dt = t.dt, q = t.q2 * dt;
    Matrix<T, n> W = U, G{};
    Vector<T, n> d = D, dq;

    for (int k = 1; k < n; ++k) W[0][k] += dt * U[1][k];
    for (int i = 2; i < n; ++i)
      for (int k = i; k < n; ++k) W[i][k] *= t.decay[i - 2];

    // Q of the speed block is U D U' with U01 = dt/2, D = q2 {dt^3/12, dt}.
    for (int i = 0; i < n; ++i) G[i][i] = 1;
    G[0][1] = dt * T(0.5);
    dq[0] = q * dt * dt * (T(1) / 12);
    dq[1] = q;
    for (int i = 2; i < n; ++i) dq[i] = t.noise[i - 2];

    for (int j = n - 1; j >= 0; --j) {
      Vector<T, n> a, c;  // row j times the weights
      T norm = 0;
      for (int k = j; k < n; ++k) {
        a[k] = d[k] * W[j][k];
        c[k] = dq[k] * G[j][k];
        norm += a[k] * W[j][k] + c[k] * G[j][k];
      }
      D[j] = norm;
      const T inverse = norm > 0 ? T(1) / norm : T(0);
      for (int i = 0; i < j; ++i) {
        T inner = 0;
        for (int k = j; k < n; ++k) inner += a[k] * W[i][k] + c[k] * G[i][k];
        U[i][j] = inner *= inverse;
        for (int k = j; k < n; ++k) {
          W[i][k] -= inner * W[j][k];
          G[i][k] -= inner * G[j][k];
        }
      }
    }
  }

  void update(const Vector<double, n>& h, double r, double z) {
    Vector<T, n> f, v, k;
    for (int j = 0; j < n; ++j) {
      f[j] = h[j];
      for (int i = 0; i < j; ++i) f[j] += U[i][j] * h[i];
      v[j] = D[j] * f[j];
    }
    // alpha grows from r to S by non-negative terms: D can only shrink, and
    // never changes sign.
    T alpha = r, inverse = 0;
    for (int j = 0; j < n; ++j) {
      const T lambda = -f[j] * inverse, before = alpha;
      alpha += f[j] * v[j];
      inverse = T(1) / alpha;
      D[j] *= before * inverse;
      k[j] = v[j];
      for (int i = 0; i < j; ++i) {
        const T u = U[i][j];
        U[i][j] = u + lambda * k[i];
        k[i] += v[j] * u;
      }
    }
    const T step = (z - dot<T, n>(h, x)) * inverse;
    for (int i = 0; i < n; ++i) x[i] += k[i] * step;
  }

  T variance(int i) const {
    T sum = D[i];
    for (int k = i + 1; k < n; ++k) sum += U[i][k] * U[i][k] * D[k];
    return sum;
  }

  Matrix<T, n> covariance() const {
    Matrix<T, n> P;
    for (int i = 0; i < n; ++i)
      for (int j = i; j < n; ++j) {
        T sum = U[i][j] * D[j];
        for (int k = j + 1; k < n; ++k) sum += U[i][k] * D[k] * U[j][k];
        P[i][j] = P[j][i] = sum;
      }
    return P;
  }

  void start(const Matrix<double, n>& U0, const Vector<double, n>& D0) {
    for (int i = 0; i < n; ++i) {
      D[i] = D0[i];
      for (int j = 0; j < n; ++j) U[i][j] = U0[i][j];
    }
  }
};
