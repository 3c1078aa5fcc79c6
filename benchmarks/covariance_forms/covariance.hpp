// The plain value (x, P) and its time update, shared by every form that keeps P.
// P is stored in full; both triangles are always bit-identical.
#pragma once
#include "model.hpp"

template <class T, int n>
struct Covariance {
  Vector<T, n> x{};
  Matrix<T, n> P{};

  // F and Q are a 2x2 block and a diagonal, so F P F' + Q takes O(n^2).
  void predict(const Transition<n>& f) {
    predict_state<T, n>(x, f);
    const T dt = f.dt, q = f.q2 * dt;
    const T q01 = q * dt * T(0.5), q00 = q01 * dt * (T(2) / 3);
    P[0][0] = (P[0][0] + q00) + ((dt + dt) * P[0][1] + (dt * dt) * P[1][1]);
    P[0][1] = (P[0][1] + q01) + dt * P[1][1];
    P[1][1] += q;
    for (int j = 2; j < n; ++j) {
      P[0][j] = (P[0][j] + dt * P[1][j]) * f.decay[j - 2];
      P[1][j] *= f.decay[j - 2];
      for (int i = 2; i <= j; ++i) P[i][j] *= T(f.decay[i - 2]) * f.decay[j - 2];
      P[j][j] += f.noise[j - 2];
    }
    mirror();
  }

  T variance(int i) const { return P[i][i]; }
  const Matrix<T, n>& covariance() const { return P; }

  // P = U D U' with unit upper triangular U: how every experiment starts.
  void start(const Matrix<double, n>& U, const Vector<double, n>& D) {
    for (int i = 0; i < n; ++i)
      for (int j = i; j < n; ++j) {
        T sum = 0;
        for (int k = j; k < n; ++k) sum += T(U[i][k]) * D[k] * U[j][k];
        P[i][j] = P[j][i] = sum;
      }
  }

 protected:
  void mirror() {
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j) P[j][i] = P[i][j];
  }

  struct Gain {
    Vector<T, n> b, k;  // b = P h',  k = b / S,  S = h P h' + r
    T inverse;          // 1 / S
  };

  // First half of every update: the gain, and the state moved by it.
  Gain correct_state(const Vector<double, n>& h, double r, double z) {
    Gain g;
    for (int i = 0; i < n; ++i) g.b[i] = dot<T, n>(h, P[i]);
    g.inverse = T(1) / (dot<T, n>(h, g.b) + r);
    const T innovation = z - dot<T, n>(h, x);
    for (int i = 0; i < n; ++i) {
      g.k[i] = g.b[i] * g.inverse;
      x[i] += g.k[i] * innovation;
    }
    return g;
  }

  // P - b b' / S: the products do not wait for the division.
  void subtract_outer(const Gain& g) {
    for (int i = 0; i < n; ++i)
      for (int j = i; j < n; ++j) P[i][j] -= (g.b[i] * g.b[j]) * g.inverse;
    mirror();
  }
};
