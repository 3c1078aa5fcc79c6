#include "dense.hpp"

#include <Eigen/Dense>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

namespace surefix::test {

FQ after(const FQ& first, const FQ& second) {
  return {second.F * first.F, second.F * first.Q * second.F.transpose() + second.Q};
}

FQ van_loan(const Eigen::MatrixXd& A, const Eigen::MatrixXd& W, double dt) {
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

Eigen::MatrixXd lyapunov(const Eigen::MatrixXd& A, const Eigen::MatrixXd& W) {
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

void Kalman::predict(const FQ& transition) {
  const MatrixR F = transition.F.cast<Real>();
  x = F * x;
  P = F * P * F.transpose() + transition.Q.cast<Real>();
}

Real Kalman::update(const Eigen::VectorXd& row, Real r, Real innovation) {
  const VectorR h = row.cast<Real>();
  const Real S = h.dot(P * h) + r;
  const VectorR k = P * h / S;
  const MatrixR A = MatrixR::Identity(x.size(), x.size()) - k * h.transpose();
  x += k * innovation;
  P = A * P * A.transpose() + r * k * k.transpose();
  return S;
}

double error_of(const MatrixR& actual, const MatrixR& expected) {
  const Real scale = expected.cwiseAbs().maxCoeff();
  return static_cast<double>((actual - expected).cwiseAbs().maxCoeff() / (scale > 0 ? scale : 1));
}

double covariance_error_of(const MatrixR& actual, const MatrixR& expected) {
  const VectorR scale = expected.diagonal().cwiseSqrt().cwiseInverse();
  return static_cast<double>(
      (scale.asDiagonal() * (actual - expected) * scale.asDiagonal()).cwiseAbs().maxCoeff());
}

double smallest_correlation_eigenvalue(const Eigen::MatrixXd& P) {
  if (!(P.diagonal().minCoeff() > 0.0)) return -std::numeric_limits<double>::infinity();
  const MatrixR full = P.cast<Real>();
  const VectorR scale = full.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixR correlation = scale.asDiagonal() * full * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixR> solver(correlation, Eigen::EigenvaluesOnly);
  return static_cast<double>(solver.eigenvalues()(0));
}

Eigen::MatrixXd random_matrix(Random& random, int rows, int columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

Eigen::MatrixXd random_covariance(Random& random, int n) {
  const Eigen::MatrixXd A = random_matrix(random, n, n);
  const Eigen::MatrixXd S = A * A.transpose() + 0.5 * Eigen::MatrixXd::Identity(n, n);
  return 0.5 * (S + S.transpose());
}

}  // namespace surefix::test
