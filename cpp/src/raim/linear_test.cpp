#include "surefix/raim/linear_test.hpp"

#include <Eigen/QR>

namespace surefix::raim {
namespace {

constexpr double lost = 1e-10;

/// `columns` with each divided by `length` of the column; those of length 0 stay.
Eigen::MatrixXd scaled(const Eigen::MatrixXd& columns, const Eigen::VectorXd& length) {
  Eigen::MatrixXd out = columns;
  for (Eigen::Index j = 0; j < out.cols(); ++j)
    if (length(j) > 0.0) out.col(j) /= length(j);
  return out;
}

/// L⁻¹ `columns`. There may be none, for which Eigen would read where nothing is.
Eigen::MatrixXd whitened(const Eigen::MatrixXd& L, const Eigen::MatrixXd& columns) {
  if (columns.cols() == 0) return columns;
  return L.triangularView<Eigen::Lower>().solve(columns);
}

/// Q (n × n) whose first `rank` columns span those of `columns`, which are of length ≤ 1.
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns, Eigen::Index& rank) {
  const Eigen::Index n = columns.rows();
  rank = 0;
  if (columns.cols() == 0) return Eigen::MatrixXd::Identity(n, n);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  const Eigen::Index most = std::min(n, columns.cols());
  while (rank < most && std::abs(qr.matrixQR()(rank, rank)) > lost) ++rank;
  return qr.householderQ() * Eigen::MatrixXd::Identity(n, n);
}

}  // namespace

ConfigStatus LinearTest::make(const Eigen::MatrixXd& H, const Eigen::MatrixXd& M,
                              const Eigen::MatrixXd& L, LinearTest& out) {
  const Eigen::Index n = L.rows();
  if (n == 0 || L.cols() != n || H.rows() != n || (M.cols() > 0 && M.rows() != n))
    return ConfigStatus::wrong_size;
  if (!H.allFinite() || !M.allFinite() || !L.allFinite()) return ConfigStatus::not_finite;
  if (L.diagonal().minCoeff() <= 0.0) return ConfigStatus::not_positive;
  LinearTest test;
  test.whitening_ = whitened(L, Eigen::MatrixXd::Identity(n, n));

  const Eigen::MatrixXd white = whitened(L, H);
  Eigen::Index q = 0;
  const Eigen::MatrixXd Q = orthonormal(scaled(white, white.colwise().stableNorm()), q);
  test.W_ = Q.rightCols(n - q).transpose();
  test.parity_ = test.W_ * test.whitening_;

  if (M.cols() == 0) {
    test.projection_ = test.parity_;
  } else {
    const Eigen::MatrixXd faults = whitened(L, M);
    Eigen::Index r = 0;
    const Eigen::MatrixXd seen = scaled(test.W_ * faults, faults.colwise().stableNorm());
    const Eigen::MatrixXd basis = orthonormal(seen, r);
    test.projection_ = basis.leftCols(r).transpose() * test.parity_;
  }
  if (!test.whitening_.allFinite() || !test.parity_.allFinite() || !test.projection_.allFinite())
    return ConfigStatus::not_finite;
  out = std::move(test);
  return ConfigStatus::ok;
}

double LinearTest::statistic(const double* y) const noexcept {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < projection_.rows(); ++i) {
    double z = 0.0;
    for (Eigen::Index j = 0; j < projection_.cols(); ++j) z += projection_(i, j) * y[j];
    sum += z * z;
  }
  return sum;
}

void LinearTest::parity(const double* y, double* z) const noexcept {
  for (Eigen::Index i = 0; i < parity_.rows(); ++i) {
    z[i] = 0.0;
    for (Eigen::Index j = 0; j < parity_.cols(); ++j) z[i] += parity_(i, j) * y[j];
  }
}

}  // namespace surefix::raim
