// Independent references: dense textbook algebra in long double, sharing no code with the engine.
#pragma once

#include <Eigen/Core>

#include "random.hpp"

namespace surefix::test {

using Real = long double;
using MatrixR = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using VectorR = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

/// F and Q of one duration.
struct FQ {
  Eigen::MatrixXd F;
  Eigen::MatrixXd Q;
};

/// F and Q of a transition of n states, from what it does to the unit vectors and to zero.
template <class Transition>
FQ dense(const Transition& transition, int n) {
  FQ out{Eigen::MatrixXd::Identity(n, n), Eigen::MatrixXd::Zero(n, n)};
  for (int j = 0; j < n; ++j) {
    auto column = out.F.col(j);
    transition.apply(column);
  }
  transition.add_noise(out.Q);
  return out;
}

/// Fᵀ of a transition, from what it does to the unit vectors.
template <class Transition>
Eigen::MatrixXd dense_transposed(const Transition& transition, int n) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Identity(n, n);
  for (int j = 0; j < n; ++j) {
    auto column = out.col(j);
    transition.apply_transposed(column);
  }
  return out;
}

/// `first`, then `second`.
FQ after(const FQ& first, const FQ& second);

/// Van Loan (1978): F and Q of dx = A x dt + dw, cov(dw) = W dt, from one block exponential.
FQ van_loan(const Eigen::MatrixXd& A, const Eigen::MatrixXd& W, double dt);

/// The stationary covariance of a stable A: A P + P Aᵀ + W = 0.
Eigen::MatrixXd lyapunov(const Eigen::MatrixXd& A, const Eigen::MatrixXd& W);

/// The Kalman filter of the textbook, covariance in Joseph's form with full matrices.
struct Kalman {
  VectorR x;
  MatrixR P;

  template <class Belief>
  explicit Kalman(const Belief& belief)
      : x(belief.x.template cast<Real>()), P(belief.P.template cast<Real>()) {}

  void predict(const FQ& transition);
  /// Row h, noise variance r, innovation ν = z − ẑ; returns S.
  Real update(const Eigen::VectorXd& h, Real r, Real innovation);
};

/// Largest difference, relative to the largest entry expected.
double error_of(const MatrixR& actual, const MatrixR& expected);
template <class A, class B>
double error(const Eigen::MatrixBase<A>& actual, const Eigen::MatrixBase<B>& expected) {
  return error_of(MatrixR(actual.template cast<Real>()), MatrixR(expected.template cast<Real>()));
}

/// Largest difference of P_ij, relative to √(P_ii P_jj): the same in any units.
double covariance_error_of(const MatrixR& actual, const MatrixR& expected);
template <class A, class B>
double covariance_error(const Eigen::MatrixBase<A>& actual, const Eigen::MatrixBase<B>& expected) {
  return covariance_error_of(MatrixR(actual.template cast<Real>()),
                             MatrixR(expected.template cast<Real>()));
}

/// Smallest eigenvalue of the correlation matrix of P; −∞ if a variance is not positive.
double smallest_correlation_eigenvalue(const Eigen::MatrixXd& P);

Eigen::MatrixXd random_matrix(Random& random, int rows, int columns);

/// Exactly symmetric, positive definite, of condition number about 10.
Eigen::MatrixXd random_covariance(Random& random, int n);

}  // namespace surefix::test
