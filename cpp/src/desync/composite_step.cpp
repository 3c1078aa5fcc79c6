#include "surefix/desync/composite_step.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>

#include "surefix/core/transition.hpp"
#include "surefix/core/update.hpp"
#include "surefix/desync/backward_sweep.hpp"

namespace surefix::desync {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A with A Aᵀ = S for a positive semidefinite S; false if S has a clearly negative direction.
bool square_root(const MatrixXd& S, MatrixXd& A) {
  const Eigen::LDLT<MatrixXd> ldlt(S);
  const VectorXd d = ldlt.vectorD();
  const double tolerance = 1e-12 * d.cwiseAbs().maxCoeff();
  if (!(d.minCoeff() >= -tolerance)) return false;
  A = ldlt.matrixL();
  A = (ldlt.transpositionsP().transpose() * A).eval() * d.cwiseMax(0.0).cwiseSqrt().asDiagonal();
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

double log_density(Index M, double log_determinant, double sse) {
  constexpr double log_2pi = 1.83787706640934548356;
  return -0.5 * (static_cast<double>(M) * log_2pi + log_determinant + sse);
}

/// One observation in whitened components: rows of L⁻¹H with unit noise, L Lᵀ = R.
struct WhitenedObservation {
  MatrixXd L;
  MatrixXd rows;
};

using Belief = Gaussian<Eigen::Dynamic>;

/// One component on its way through the sequential step.
struct Component {
  std::size_t observation;
  VectorXd row;
  Innovation<Belief> innovation;
};

/// (Γ⁻¹)_ab of two whitened components a < b of one observation (nothing moves between them),
/// from Λ after b: what a unit of a does to the innovation of b, and to all later ones.
double cross_precision(const std::vector<Component>& all, std::size_t a, std::size_t b,
                       const MatrixXd& Lambda) {
  VectorXd response = all[a].innovation.gain;  // of the state, after a
  double rho = 0.0;
  for (std::size_t c = a + 1; c <= b; ++c) {
    rho = -all[c].row.dot(response);
    response += all[c].innovation.gain * rho;
  }
  return rho / all[b].innovation.variance + response.dot(Lambda * all[b].innovation.gain);
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
  if (!square_root(P, root_P) || !square_root(m.Omega, root_Omega)) return Status::numerical;

  MatrixXd array = MatrixXd::Zero(M + n + noises, M + n);  // transposed: a column for each row above
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

Status CompositeStep::sequential(const VectorXd& x, const MatrixXd& P, const VectorXd& z,
                                 const VectorXd& u, StepUpdate& out) const {
  const CompositeMatrices& m = matrices_;
  const Index n = m.F.rows(), p = m.G.cols() / static_cast<Index>(legs_.size());
  Belief belief{x, P};
  std::vector<WhitenedObservation> whitened(observations_.size());
  std::vector<Component> components;
  components.reserve(static_cast<std::size_t>(m.HF.rows()));
  double log_determinant = 0.0;
  out.sse = 0.0;

  Index row = 0;
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    predict(belief, DenseTransition<Eigen::Dynamic>{legs_[i].F, legs_[i].Q});
    const VectorXd input = u.segment(p * static_cast<Index>(i), p);
    belief.x += legs_[i].G * input;
    if (i == observations_.size()) break;
    const Observation& observation = observations_[i];
    const Index size = observation.H.rows();
    const Eigen::LLT<MatrixXd> llt(observation.R);
    if (llt.info() != Eigen::Success) return Status::numerical;
    whitened[i] = {llt.matrixL(), llt.matrixL().solve(observation.H)};
    const VectorXd value = llt.matrixL().solve(z.segment(row, size) - observation.J * input);
    row += size;
    for (Index c = 0; c < size; ++c) {
      Component component{i, whitened[i].rows.row(c).transpose(), {}};
      const double innovation = value(c) - component.row.dot(belief.x);
      if (!update(belief, DenseRow<VectorXd>{component.row}, 1.0, innovation, component.innovation))
        return Status::numerical;
      out.sse += innovation * innovation / component.innovation.variance;
      log_determinant += std::log(component.innovation.variance);
      components.push_back(component);
    }
    log_determinant += 2.0 * whitened[i].L.diagonal().array().log().sum();  // of the whitening
  }

  const std::size_t count = components.size();
  VectorXd values(m.HF.rows());  // Γ⁻¹γ in whitened components
  std::vector<MatrixXd> precision(observations_.size());
  for (std::size_t i = 0; i < observations_.size(); ++i)
    precision[i].setZero(observations_[i].H.rows(), observations_[i].H.rows());
  auto adjoint = Adjoint<Belief>::zero(static_cast<int>(n));
  std::size_t component = count;
  for (std::size_t i = observations_.size(); i-- > 0;) {
    const std::size_t first = component - static_cast<std::size_t>(precision[i].rows());
    while (component > first) {
      --component;
      const Index b = static_cast<Index>(component - first);
      for (std::size_t a = first; a < component; ++a)
        precision[i](static_cast<Index>(a - first), b) =
            cross_precision(components, a, component, adjoint.Lambda);
      const auto w = sweep_back(adjoint, DenseRow<VectorXd>{components[component].row},
                                components[component].innovation);
      values(static_cast<Index>(component)) = w.value;
      precision[i](b, b) = w.precision;
    }
    mirror(precision[i]);
    const DenseTransition<Eigen::Dynamic> transition{legs_[i].F, legs_[i].Q};
    transition.apply_transposed(adjoint.lambda);
    propagate_transposed(adjoint.Lambda, transition);
  }

  out.noise.resize(m.HF.rows());
  out.noise_variance.resize(m.HF.rows());
  row = 0;
  for (std::size_t i = 0; i < observations_.size(); ++i) {  // v̂ = L w, its covariance L Γ⁻¹ Lᵀ
    const MatrixXd& L = whitened[i].L;
    out.noise.segment(row, L.rows()) = L * values.segment(row, L.rows());
    out.noise_variance.segment(row, L.rows()) = (L * precision[i] * L.transpose()).diagonal();
    row += L.rows();
  }
  out.innovation = z - m.HF * x - (m.LG + m.J) * u;
  out.x = belief.x;
  out.P = belief.P;
  out.log_likelihood = log_density(m.HF.rows(), log_determinant, out.sse);
  return out.x.allFinite() && out.P.allFinite() ? Status::ok : Status::numerical;
}

}  // namespace surefix::desync
