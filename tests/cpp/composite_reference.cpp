#include "composite_reference.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace surefix::test {

StepCase random_step(Random& random, int n, int p, const std::vector<int>& sizes) {
  StepCase out;
  int M = 0;
  for (int m : sizes) M += m;
  out.Upsilon = Eigen::MatrixXd::Zero(M, M);
  int row = 0;
  for (int m : sizes) {
    const Eigen::MatrixXd R = random_covariance(random, m);
    out.observations.push_back({random_matrix(random, m, n), R, random_matrix(random, m, p)});
    out.Upsilon.block(row, row, m, m) = R;
    row += m;
  }
  for (std::size_t i = 0; i <= sizes.size(); ++i) {
    const Eigen::MatrixXd F = Eigen::MatrixXd::Identity(n, n) + 0.3 * random_matrix(random, n, n);
    out.legs.push_back({F, 0.1 * random_covariance(random, n), random_matrix(random, n, p)});
  }
  out.x = random_matrix(random, n, 1);
  out.P = random_covariance(random, n);
  out.z = random_matrix(random, M, 1);
  out.u = random_matrix(random, p * static_cast<int>(out.legs.size()), 1);
  return out;
}

StepReference brute_force(const StepCase& step) {
  const Eigen::Index n = step.x.size(), M = step.z.size(), p = step.legs[0].G.cols();
  const auto legs = static_cast<Eigen::Index>(step.legs.size());
  const Eigen::Index noise = n + n * legs, all = noise + M;
  MatrixR covariance = MatrixR::Zero(all, all);
  covariance.topLeftCorner(n, n) = step.P.cast<Real>();
  covariance.bottomRightCorner(M, M) = step.Upsilon.cast<Real>();
  VectorR mean = VectorR::Zero(all);
  mean.head(n) = step.x.cast<Real>();

  MatrixR state = MatrixR::Zero(n, all), reading = MatrixR::Zero(M, all);
  VectorR state_known = VectorR::Zero(n), reading_known = VectorR::Zero(M);
  state.leftCols(n).setIdentity();
  Eigen::Index row = 0;
  for (Eigen::Index i = 0; i < legs; ++i) {
    const desync::Leg& leg = step.legs[static_cast<std::size_t>(i)];
    const VectorR input = step.u.segment(p * i, p).cast<Real>();
    covariance.block(n + n * i, n + n * i, n, n) = leg.Q.cast<Real>();
    state = leg.F.cast<Real>() * state;
    state.middleCols(n + n * i, n).setIdentity();
    state_known = leg.F.cast<Real>() * state_known + leg.G.cast<Real>() * input;
    if (i + 1 == legs) break;
    const desync::Observation& observation = step.observations[static_cast<std::size_t>(i)];
    const Eigen::Index m = observation.H.rows();
    reading.middleRows(row, m) = observation.H.cast<Real>() * state;
    reading.block(row, noise + row, m, m).setIdentity();
    reading_known.segment(row, m) =
        observation.H.cast<Real>() * state_known + observation.J.cast<Real>() * input;
    row += m;
  }

  StepReference out;
  out.Gamma = reading * covariance * reading.transpose();
  out.C = state * covariance * reading.transpose();
  out.innovation = step.z.cast<Real>() - reading * mean - reading_known;
  out.x = state * mean + state_known;
  out.P = state * covariance * state.transpose();
  if (M == 0) return out;
  const Eigen::FullPivLU<MatrixR> lu(out.Gamma);
  const VectorR w = lu.solve(out.innovation);
  const MatrixR noise_reading = covariance.bottomRows(M) * reading.transpose();
  out.x += out.C * w;
  out.P -= out.C * lu.solve(out.C.transpose());
  out.noise = noise_reading * w;
  out.noise_variance = (noise_reading * lu.solve(noise_reading.transpose())).diagonal();
  out.sse = out.innovation.dot(w);
  out.log_likelihood = -0.5L * (static_cast<Real>(M) * 1.8378770664093454835607L +
                                std::log(lu.determinant()) + out.sse);
  return out;
}

}  // namespace surefix::test
