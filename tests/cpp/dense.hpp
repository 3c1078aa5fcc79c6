// Independent references: dense textbook algebra in long double, sharing no code with the engine.
#pragma once

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

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
inline FQ after(const FQ& first, const FQ& second) {
  return {second.F * first.F, second.F * first.Q * second.F.transpose() + second.Q};
}

/// Van Loan (1978): F and Q of dx = A x dt + dw, cov(dw) = W dt, from one block exponential.
inline FQ van_loan(const Eigen::MatrixXd& A, const Eigen::MatrixXd& W, double dt) {
  const Eigen::Index n = A.rows();
  MatrixR block = MatrixR::Zero(2 * n, 2 * n);
  block.topLeftCorner(n, n) = -A.cast<Real>();
  block.topRightCorner(n, n) = W.cast<Real>();
  block.bottomRightCorner(n, n) = A.transpose().cast<Real>();
  block *= dt;
  const MatrixR exponential = block.exp();
  const MatrixR F = exponential.bottomRightCorner(n, n).transpose();
  const MatrixR Q = F * exponential.topRightCorner(n, n);
  return {F.cast<double>(), Q.cast<double>()};
}

/// The stationary covariance of a stable A: A P + P Aᵀ + W = 0.
inline Eigen::MatrixXd lyapunov(const Eigen::MatrixXd& A, const Eigen::MatrixXd& W) {
  const Eigen::Index n = A.rows();
  MatrixR system = MatrixR::Zero(n * n, n * n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index k = 0; k < n; ++k) {
        system(i + n * j, k + n * j) += A(i, k);
        system(i + n * j, i + n * k) += A(j, k);
      }
  const VectorR right = -Eigen::Map<const Eigen::VectorXd>(W.data(), n * n).cast<Real>();
  const VectorR P = system.fullPivLu().solve(right);
  return Eigen::Map<const MatrixR>(P.data(), n, n).cast<double>();
}

/// The Kalman filter of the textbook, covariance in Joseph's form with full matrices.
struct Kalman {
  VectorR x;
  MatrixR P;

  template <class Belief>
  explicit Kalman(const Belief& belief)
      : x(belief.x.template cast<Real>()), P(belief.P.template cast<Real>()) {}

  void predict(const FQ& transition) {
    const MatrixR F = transition.F.cast<Real>();
    x = F * x;
    P = F * P * F.transpose() + transition.Q.cast<Real>();
  }
  /// Row h, noise variance r, innovation ν = z − ẑ; returns S.
  Real update(const Eigen::VectorXd& row, Real r, Real innovation) {
    const VectorR h = row.cast<Real>();
    const Real S = h.dot(P * h) + r;
    const VectorR k = P * h / S;
    const MatrixR A = MatrixR::Identity(x.size(), x.size()) - k * h.transpose();
    x += k * innovation;
    P = A * P * A.transpose() + r * k * k.transpose();
    return S;
  }
};

/// Largest difference, relative to the largest entry expected.
template <class A, class B>
double error(const Eigen::MatrixBase<A>& actual, const Eigen::MatrixBase<B>& expected) {
  const MatrixR a = actual.template cast<Real>(), e = expected.template cast<Real>();
  const Real scale = e.cwiseAbs().maxCoeff();
  return static_cast<double>((a - e).cwiseAbs().maxCoeff() / (scale > 0 ? scale : 1));
}

/// Largest difference of P_ij, relative to √(P_ii P_jj): the same in any units.
template <class A, class B>
double covariance_error(const Eigen::MatrixBase<A>& actual, const Eigen::MatrixBase<B>& expected) {
  const MatrixR a = actual.template cast<Real>(), e = expected.template cast<Real>();
  const VectorR scale = e.diagonal().cwiseSqrt().cwiseInverse();
  return static_cast<double>(
      (scale.asDiagonal() * (a - e) * scale.asDiagonal()).cwiseAbs().maxCoeff());
}

/// Smallest eigenvalue of the correlation matrix of P; −∞ if a variance is not positive.
template <class Derived>
double smallest_correlation_eigenvalue(const Eigen::MatrixBase<Derived>& P) {
  const MatrixR full = P.template cast<Real>();
  if (!(full.diagonal().minCoeff() > 0)) return -std::numeric_limits<double>::infinity();
  const VectorR scale = full.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixR correlation = scale.asDiagonal() * full * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixR> solver(correlation, Eigen::EigenvaluesOnly);
  return static_cast<double>(solver.eigenvalues()(0));
}

inline Eigen::MatrixXd random_matrix(Random& random, int rows, int columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

/// Exactly symmetric, positive definite, of condition number about 10.
inline Eigen::MatrixXd random_covariance(Random& random, int n) {
  const Eigen::MatrixXd A = random_matrix(random, n, n);
  const Eigen::MatrixXd S = A * A.transpose() + 0.5 * Eigen::MatrixXd::Identity(n, n);
  return 0.5 * (S + S.transpose());
}

}  // namespace surefix::test
