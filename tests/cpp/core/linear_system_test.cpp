#include "surefix/core/linear_system.hpp"

#include <gtest/gtest.h>

namespace surefix {
namespace {

using Eigen::MatrixXd;

LinearSystem two_states() {
  LinearSystem system;
  system.A = system.Q = system.R = {MatrixXd::Identity(2, 2)};
  system.H = {(MatrixXd(2, 2) << 1.0, 0.5, 0.0, 2.0).finished()};
  system.x0 = Eigen::Vector2d(1.0, -1.0);
  system.P0 = MatrixXd::Identity(2, 2);
  return system;
}

/// What `make` says of the system after a change: the same for fixed sizes and for any.
template <class Change>
ConfigStatus after(Change&& change) {
  LinearSystem system = two_states();
  change(system);
  PreparedSystem<AnyLinearSizes> any;
  PreparedSystem<LinearSizes<2, 2>> fixed;
  const ConfigStatus status = any.make(system);
  EXPECT_EQ(fixed.make(system), status);
  return status;
}

TEST(LinearSystem, HasMatricesForAllStepsOrOneForEach) {
  EXPECT_EQ(two_states().steps(), 0);
  EXPECT_EQ(after([](LinearSystem&) {}), ConfigStatus::ok);
  const auto of_three_steps = [](LinearSystem& s) {
    s.A.assign(2, 2.0 * s.A[0]);
    s.R.assign(3, s.R[0]);
    s.R[2] *= 4.0;
    EXPECT_EQ(s.steps(), 3);
  };
  EXPECT_EQ(after(of_three_steps), ConfigStatus::ok);
  LinearSystem system = two_states();
  of_three_steps(system);
  PreparedSystem<LinearSizes<2, 2>> prepared;
  ASSERT_EQ(prepared.make(system), ConfigStatus::ok);
  EXPECT_EQ(prepared.transition(2).F(0, 0), 2.0);
  EXPECT_EQ(prepared.observation(2).variance(0), 4.0);
  EXPECT_EQ(prepared.observation(1).variance(0), 1.0);
}

TEST(LinearSystem, RefusesNumbersOfMatricesThatDoNotFit) {
  LinearSystem unmeasured = two_states();
  unmeasured.H.clear();
  EXPECT_EQ(unmeasured.measured(), 0);
  for (const auto remove : {&LinearSystem::A, &LinearSystem::Q, &LinearSystem::H, &LinearSystem::R})
    EXPECT_EQ(after([&](LinearSystem& s) { (s.*remove).clear(); }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](LinearSystem& s) {
              s.A.assign(2, s.A[0]);
              s.Q.assign(3, s.Q[0]);
            }),
            ConfigStatus::wrong_size);
  EXPECT_EQ(after([](LinearSystem& s) {
              s.H.assign(3, s.H[0]);
              s.R.assign(2, s.R[0]);
            }),
            ConfigStatus::wrong_size);
}

TEST(LinearSystem, RefusesMatricesOfTheWrongSize) {
  const MatrixXd tall = MatrixXd::Identity(3, 2), wide = MatrixXd::Identity(2, 3);
  EXPECT_EQ(after([](LinearSystem& s) { s.x0.resize(0); }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](LinearSystem& s) {
              s.H = {MatrixXd::Ones(33, 2)};
              s.R = {MatrixXd::Identity(33, 33)};
            }),
            ConfigStatus::wrong_size);
  for (const MatrixXd& bad : {tall, wide}) {
    EXPECT_EQ(after([&](LinearSystem& s) { s.P0 = bad; }), ConfigStatus::wrong_size);
    EXPECT_EQ(after([&](LinearSystem& s) { s.A = {bad}; }), ConfigStatus::wrong_size);
    EXPECT_EQ(after([&](LinearSystem& s) { s.Q = {bad}; }), ConfigStatus::wrong_size);
    EXPECT_EQ(after([&](LinearSystem& s) { s.R = {bad}; }), ConfigStatus::wrong_size);
    EXPECT_EQ(after([&](LinearSystem& s) { s.H = {s.H[0], bad}; }), ConfigStatus::wrong_size);
  }
}

TEST(LinearSystem, RefusesMatricesThatAreNone) {
  EXPECT_EQ(after([](LinearSystem& s) { s.A[0](1, 0) = HUGE_VAL; }), ConfigStatus::not_finite);
  EXPECT_EQ(after([](LinearSystem& s) { s.Q[0](1, 1) = std::nan(""); }), ConfigStatus::not_finite);
  EXPECT_EQ(after([](LinearSystem& s) { s.Q[0](1, 1) = -1.0; }), ConfigStatus::not_semidefinite);
  EXPECT_EQ(after([](LinearSystem& s) { s.H[0](0, 0) = std::nan(""); }), ConfigStatus::not_finite);
  EXPECT_EQ(after([](LinearSystem& s) { s.R[0](1, 1) = 0.0; }), ConfigStatus::not_positive);
  EXPECT_EQ(after([](LinearSystem& s) { s.P0(0, 1) = 0.1; }), ConfigStatus::not_semidefinite);
  EXPECT_EQ(after([](LinearSystem& s) { s.x0(0) = HUGE_VAL; }), ConfigStatus::not_finite);
}

}  // namespace
}  // namespace surefix
