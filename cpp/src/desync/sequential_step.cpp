// The sequential way through a composite step: whitened components, one scalar update each, and
// one backward sweep for the noise.
#include <Eigen/Cholesky>
#include <cmath>

#include "log_density.hpp"
#include "surefix/core/transition.hpp"
#include "surefix/core/update.hpp"
#include "surefix/desync/backward_sweep.hpp"
#include "surefix/desync/composite_step.hpp"

namespace surefix::desync {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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
    predict(belief, DenseTransition<Eigen::Dynamic>{{legs_[i].F}, legs_[i].Q});
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
    const DenseTransition<Eigen::Dynamic> transition{{legs_[i].F}, legs_[i].Q};
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
