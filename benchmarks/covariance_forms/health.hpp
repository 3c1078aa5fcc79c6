// What is measured on a covariance: definiteness on its own, error against a
// reference.
#pragma once
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "model.hpp"

// Smallest eigenvalue of the correlation matrix; 0 stands for "not below
// -n eps", and -1 for a diagonal that is not positive and finite.
template <int n>
double smallest_eigenvalue(const Matrix<double, n>& P) {
  Vector<double, n> scale;
  for (int i = 0; i < n; ++i) {
    if (!(P[i][i] > 0 && std::isfinite(P[i][i]))) return -1;
    scale[i] = 1 / std::sqrt(P[i][i]);
  }
  Eigen::Matrix<double, n, n> C;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) C(i, j) = i == j ? 1 : P[i][j] * scale[i] * scale[j];
  if (!C.allFinite()) return -1;
  if constexpr (n == 2) return std::min(0., 1 - std::abs(C(0, 1)));
  if (C.llt().info() == Eigen::Success) return 0;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, n, n>> solver(C, Eigen::EigenvaluesOnly);
  return std::min(0., solver.eigenvalues()[0]);
}

struct Health {
  long steps = 0, indefinite = 0, bad_diagonal = 0;
  double smallest = 0;                        // eigenvalue of the correlation matrix
  double diagonal_error = 0, pair_error = 0;  // relative, see compare()

  template <int n>
  void check(const Matrix<double, n>& P) {
    const double lambda = smallest_eigenvalue<n>(P);
    ++steps;
    indefinite += lambda < -1e-12;
    bad_diagonal += lambda == -1;
    smallest = std::min(smallest, lambda);
  }

  template <int n, class T>
  void compare(const Matrix<double, n>& P, const Matrix<T, n>& exact) {
    for (int i = 0; i < n; ++i)
      for (int j = i; j < n; ++j) {
        const double d = std::abs(double(T(P[i][j]) - exact[i][j]));
        const double e = d / std::sqrt(double(exact[i][i])) / std::sqrt(double(exact[j][j]));
        double& worst = i == j ? diagonal_error : pair_error;
        if (!(e <= worst)) worst = std::isnan(e) ? INFINITY : e;
      }
  }

  void merge(const Health& o) {
    steps += o.steps;
    indefinite += o.indefinite;
    bad_diagonal += o.bad_diagonal;
    smallest = std::min(smallest, o.smallest);
    diagonal_error = std::max(diagonal_error, o.diagonal_error);
    pair_error = std::max(pair_error, o.pair_error);
  }
};

// Collinearity: max_j P_jj / D_j, the factor by which knowing the later states
// shrinks the variance of state j.  n = 2: exactly 1 / (1 - correlation^2).
template <class Factored, int n>
double collinearity(const Factored& f) {
  double worst = 1;
  for (int j = 0; j < n; ++j) worst = std::max(worst, double(f.variance(j) / f.D[j]));
  return worst;
}
