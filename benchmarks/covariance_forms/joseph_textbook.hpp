// (c)  P+ = A P A' + r k k' with A = I - k h formed explicitly, O(n^3);
//      upper triangle computed, then mirrored.
#pragma once
#include "covariance.hpp"

template <class T, int n>
struct JosephTextbook : Covariance<T, n> {
  void update(const Vector<double, n>& h, double r, double z) {
    const Vector<T, n> k = this->correct_state(h, r, z).k;
    auto& P = this->P;

    Matrix<T, n> A, AP{};
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) A[i][j] = T(i == j) - k[i] * h[j];
    for (int i = 0; i < n; ++i)
      for (int l = 0; l < n; ++l)
        for (int j = 0; j < n; ++j) AP[i][j] += A[i][l] * P[l][j];
    for (int i = 0; i < n; ++i)
      for (int j = i; j < n; ++j) {
        T sum = 0;
        for (int l = 0; l < n; ++l) sum += AP[i][l] * A[j][l];
        P[i][j] = sum + r * k[i] * k[j];
      }
    this->mirror();
  }
};
