#include "surefix/desync/composite_step.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "log_density.hpp"
#include "surefix/core/gaussian.hpp"

namespace surefix::desync {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A with A Aᵀ = S for a positive semidefinite S, by Cholesky with pivoting; false if S has a
/// clearly negative direction. Pivots are compared with their component's own variance, so that
/// units do not matter; what is left at the size of rounding is zero, not a number to divide by.
bool square_root(const MatrixXd& S, MatrixXd& A) {
  const Index n = S.rows();
  const double rounding = 4.0 * static_cast<double>(n) * std::numeric_limits<double>::epsilon();
  MatrixXd rest = S;
  A = MatrixXd::Zero(n, n);
  for (Index k = 0; k < n; ++k) {
    Index pivot = -1;
    double largest = rounding, smallest = 0.0;
    for (Index i = 0; i < n; ++i) {
      if (S(i, i) < 0.0 || (S(i, i) == 0.0 && !S.row(i).isZero(0.0))) return false;
      const double part = S(i, i) > 0.0 ? rest(i, i) / S(i, i) : 0.0;
      smallest = std::min(smallest, part);
      if (part > largest) largest = part, pivot = i;
    }
    if (smallest < -1e-9) return false;
    if (pivot < 0) break;
    A.col(k) = rest.col(pivot) / std::sqrt(rest(pivot, pivot));
    rest -= A.col(k) * A.col(k).transpose();
    rest.row(pivot).setZero();
    rest.col(pivot).setZero();
  }
  return true;
}

/// The same for Ω, block by block.
bool square_root(const std::vector<Leg>& legs, MatrixXd& A) {
  const Index n = legs[0].Q.rows();
  A = MatrixXd::Zero(n * static_cast<Index>(legs.size()), n * static_cast<Index>(legs.size()));
  MatrixXd block;
  for (std::size_t i = 0; i < legs.size(); ++i) {
    if (!square_root(legs[i].Q, block)) return false;
    A.block(n * static_cast<Index>(i), n * static_cast<Index>(i), n, n) = block;
  }
  return true;
}

bool is_separable(const std::vector<Observation>& observations, const MatrixXd& Upsilon) {
  MatrixXd rest = Upsilon;
  Index row = 0;
  for (const Observation& observation : observations) {
    const Index m = observation.H.rows();
    rest.block(row, row, m, m).setZero();
    row += m;
  }
  return rest.isZero(0.0);
}

}  // namespace

CompositeStep::CompositeStep(std::vector<Leg> legs, std::vector<Observation> observations)
    : legs_(std::move(legs)),
      observations_(std::move(observations)),
      matrices_(composite_matrices(legs_, observations_)),
      separable_(true) {}

CompositeStep::CompositeStep(std::vector<Leg> legs, std::vector<Observation> observations,
                             const MatrixXd& Upsilon)
    : CompositeStep(std::move(legs), std::move(observations)) {
  matrices_.Upsilon = Upsilon;
  separable_ = is_separable(observations_, Upsilon);
  Index row = 0;
  for (Observation& observation : observations_) {  // the fast way takes its blocks from here
    const Index m = observation.H.rows();
    observation.R = Upsilon.block(row, row, m, m);
    row += m;
  }
}

MatrixXd CompositeStep::Gamma(const MatrixXd& P) const {
  const CompositeMatrices& m = matrices_;
  return m.HF * P * m.HF.transpose() + m.L * m.Omega * m.L.transpose() + m.Upsilon;
}

MatrixXd CompositeStep::cross_covariance(const MatrixXd& P) const {
  const CompositeMatrices& m = matrices_;
  return m.F * P * m.HF.transpose() + m.W * m.Omega * m.L.transpose();
}

// The square-root array: an orthogonal transformation of
//   [ Υ^½  HF P^½  L Ω^½ ]        [ Γ^½      0   ]
//   [ 0    F P^½   W Ω^½ ]  into  [ C Γ^−½ᵀ  P⁺^½ ],
// because both sides have the same product with their own transpose. It never forms Γ or its
// inverse, P⁺ is a square by construction, and P, Ω and F may be singular.
Status CompositeStep::composite(const VectorXd& x, const MatrixXd& P, const VectorXd& z,
                                const VectorXd& u, StepUpdate& out) const {
  const CompositeMatrices& m = matrices_;
  const Index n = m.F.rows(), M = m.HF.rows(), noises = m.W.cols();
  const Eigen::LLT<MatrixXd> upsilon(m.Upsilon);
  MatrixXd root_P, root_Omega;
  if (M > 0 && upsilon.info() != Eigen::Success) return Status::numerical;
  if (!square_root(P, root_P) || !square_root(legs_, root_Omega)) return Status::numerical;

  MatrixXd array =
      MatrixXd::Zero(M + n + noises, M + n);  // transposed: a column for each row above
  if (M > 0) array.topLeftCorner(M, M) = MatrixXd(upsilon.matrixL()).transpose();
  array.block(M, 0, n, M) = (m.HF * root_P).transpose();
  array.block(M + n, 0, noises, M) = (m.L * root_Omega).transpose();
  array.block(M, M, n, n) = (m.F * root_P).transpose();
  array.block(M + n, M, noises, n) = (m.W * root_Omega).transpose();
  const Eigen::HouseholderQR<MatrixXd> qr(array);
  const MatrixXd post = qr.matrixQR().topRows(M + n).triangularView<Eigen::Upper>();
  const MatrixXd root_Gamma = post.topLeftCorner(M, M).transpose();  // lower, any signs
  const MatrixXd gain = post.topRightCorner(M, n).transpose();       // C Γ^−½ᵀ
  const MatrixXd root_posterior = post.bottomRightCorner(n, n).transpose();

  out.innovation = z - m.HF * x - (m.LG + m.J) * u;
  const auto triangle = root_Gamma.triangularView<Eigen::Lower>();
  const VectorXd whitened = triangle.solve(out.innovation);
  out.x = m.F * x + m.G * u + gain * whitened;
  out.P = root_posterior * root_posterior.transpose();
  mirror(out.P);
  out.noise = m.Upsilon * triangle.transpose().solve(whitened);
  const MatrixXd root_precision = triangle.solve(m.Upsilon);
  out.noise_variance = root_precision.colwise().squaredNorm().transpose();
  out.sse = whitened.squaredNorm();
  const double log_determinant = 2.0 * root_Gamma.diagonal().array().abs().log().sum();
  out.log_likelihood = log_density(M, log_determinant, out.sse);
  return out.x.allFinite() && out.P.allFinite() ? Status::ok : Status::numerical;
}

}  // namespace surefix::desync
