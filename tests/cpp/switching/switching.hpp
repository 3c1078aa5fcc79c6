// A small switching system for the tests.
#pragma once

#include <gtest/gtest.h>

#include "surefix/switching/bank_batch.hpp"
#include "surefix/switching/filter.hpp"

namespace surefix::switching::testing {

using Two = Sizes<2, 4>;

inline ModeChain four_modes() {
  Eigen::MatrixXd gamma(2, 2), delta(2, 2);
  gamma << 0.9, 0.1, 0.6, 0.4;
  delta << 0.8, 0.2, 0.5, 0.5;
  ModeChain chain;
  EXPECT_TRUE(ModeChain::independent({1.0, 0.0}, gamma, {1.0, 10.0}, delta, chain));
  return chain;
}

inline LinearSystem two_states() {
  LinearSystem system;
  system.A = {(Eigen::Matrix2d() << 1.0, 0.5, -0.2, 0.7).finished()};
  system.Q = {Eigen::Vector2d(0.3, 0.1).asDiagonal().toDenseMatrix()};
  system.H = {(Eigen::MatrixXd(1, 2) << 1.0, 0.3).finished()};
  system.R = {Eigen::MatrixXd::Constant(1, 1, 0.5)};
  system.x0 = Eigen::Vector2d(1.0, -1.0);
  system.P0 = Eigen::Vector2d(2.0, 1.0).asDiagonal();
  return system;
}

/// Measurements with gross outliers and gaps.
inline double measurement(int run, int k) {
  if ((k + run) % 11 == 5) return std::numeric_limits<double>::quiet_NaN();
  if ((k * 7 + run) % 37 == 3) return run % 2 == 0 ? 1e4 : -200.0;
  return 2.0 * std::sin(0.3 * k + run);
}

/// The prepared system with its one transition and observation.
struct Prepared {
  PreparedSystem<Two> system;

  Prepared() { EXPECT_EQ(system.make(two_states()), ConfigStatus::ok); }
  [[nodiscard]] const Transition<Two>& transition() const { return system.transition(1); }
  [[nodiscard]] const Observation<Two>& observation() const { return system.observation(0); }
};

}  // namespace surefix::switching::testing
