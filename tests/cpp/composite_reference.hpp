// The composite step by brute force: everything unknown in one vector ξ = (x, ω_1 … ω_{N+1}, v),
// state and measurements as linear functions of it, and the conditioning of a joint Gaussian.
#pragma once

#include "dense.hpp"
#include "surefix/desync/composite_step.hpp"

namespace surefix::test {

/// A step and all that it is computed from.
struct StepCase {
  std::vector<desync::Leg> legs;
  std::vector<desync::Observation> observations;
  Eigen::MatrixXd Upsilon;  ///< M × M
  Eigen::VectorXd x;
  Eigen::MatrixXd P;
  Eigen::VectorXd z;
  Eigen::VectorXd u;
};

/// n states, p inputs, one observation for each entry of `sizes`, with so many components.
StepCase random_step(Random& random, int n, int p, const std::vector<int>& sizes);

struct StepReference {
  VectorR x;
  MatrixR P;
  VectorR innovation;
  VectorR noise;
  VectorR noise_variance;
  Real sse = 0.0;
  Real log_likelihood = 0.0;
  MatrixR Gamma;
  MatrixR C;
};

StepReference brute_force(const StepCase& step);

}  // namespace surefix::test
