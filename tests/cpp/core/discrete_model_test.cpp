#include "surefix/core/discrete_model.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "dense.hpp"
#include "systems.hpp"

namespace surefix {
namespace {

using namespace test;
using Model = DiscreteModel<3>;

struct Example {
  Eigen::Matrix3d F, Q;
  Model model;
  Example() : Example(Random(5)) {}
  explicit Example(Random random)
      : F(0.5 * random_matrix(random, 3, 3)),
        Q(random_covariance(random, 3)),
        model(F, Q, 100 * millisecond) {}
  FQ over(Time elapsed) const {
    Model::Transition transition;
    EXPECT_EQ(model.transition(elapsed, transition), Status::ok);
    return {transition.F, transition.Q};
  }
};

TEST(DiscreteModel, OverKPeriodsIsKSteps) {
  const Example example;
  FQ expected{Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero()};
  for (int k = 0; k <= 40; ++k) {
    const FQ actual = example.over(k * 100 * millisecond);
    EXPECT_LT(error(actual.F, expected.F), 1e-13);
    EXPECT_LT(error(actual.Q, expected.Q), 1e-13);
    EXPECT_TRUE(exactly_symmetric(actual.Q));
    expected = after(expected, {example.F, example.Q});
  }
}

TEST(DiscreteModel, TwoDurationsAreOneAfterTheOther) {
  const Example example;
  for (int a : {1, 3, 8, 100})
    for (int b : {0, 1, 5, 77}) {
      const FQ once = example.over((a + b) * 100 * millisecond);
      const FQ twice =
          after(example.over(a * 100 * millisecond), example.over(b * 100 * millisecond));
      EXPECT_LT(error(twice.F, once.F), 1e-13);
      EXPECT_LT(error(twice.Q, once.Q), 1e-13);
    }
}

TEST(DiscreteModel, OffTheGridIsOffGrid) {
  const Example example;
  Model::Transition out;
  for (Time elapsed : {Time{1}, 50 * millisecond, 100 * millisecond + 1, 100 * millisecond - 1})
    EXPECT_EQ(example.model.transition(elapsed, out), Status::off_grid) << elapsed;
}

TEST(DiscreteModel, WithoutAPeriodEveryDurationIsOffGrid) {
  const Example example;
  Model::Transition out;
  for (Time period : {Time{0}, Time{-1}, -100 * millisecond})
    for (Time elapsed : {Time{0}, Time{1}, 100 * millisecond, std::numeric_limits<Time>::min()})
      EXPECT_EQ(Model(example.F, example.Q, period).transition(elapsed, out), Status::off_grid);
}

TEST(DiscreteModel, ChecksItsParameters) {
  const Example good;
  const auto check = [&](auto change, Time period = second) {
    Example bad;
    change(bad);
    return Model(bad.F, bad.Q, period).check();
  };
  const auto as_it_is = [](Example&) {};
  EXPECT_EQ(check(as_it_is), ConfigStatus::ok);
  EXPECT_EQ(check(as_it_is, 0), ConfigStatus::not_positive);
  EXPECT_EQ(check(as_it_is, -second), ConfigStatus::not_positive);
  EXPECT_EQ(check([](Example& e) { e.F(0, 0) = HUGE_VAL; }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Example& e) { e.Q(0, 0) = std::nan(""); }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Example& e) { e.Q(2, 0) += 0.1; }), ConfigStatus::not_semidefinite);
  EXPECT_EQ(check([](Example& e) { e.Q(1, 1) = -1.0; }), ConfigStatus::not_semidefinite);
  EXPECT_EQ(check([](Example& e) { e.Q.setZero(); }), ConfigStatus::ok);

  using Bounded = DiscreteModel<Eigen::Dynamic, 8>;
  const Eigen::MatrixXd two = Eigen::MatrixXd::Identity(2, 2);
  EXPECT_EQ(Bounded(two, two, second).check(), ConfigStatus::ok);
  EXPECT_EQ(Bounded(two, good.Q, second).check(), ConfigStatus::wrong_size);
  EXPECT_EQ(Bounded(Eigen::MatrixXd::Ones(3, 2), good.Q, second).check(), ConfigStatus::wrong_size);
}

TEST(DiscreteModel, OverAYearIsStationaryIfStable) {
  const Eigen::Matrix3d F = 0.9 * Eigen::Matrix3d::Identity(), Q = Eigen::Matrix3d::Identity();
  Model::Transition out;
  ASSERT_EQ(Model(F, Q, 100 * millisecond).transition(year, out), Status::ok);
  EXPECT_LT(error(out.Q, Q / (1.0 - 0.81)), 1e-14);
}

TEST(DiscreteModel, OverAYearIsNumericalIfUnstable) {
  const Eigen::Matrix3d F = 1.1 * Eigen::Matrix3d::Identity();
  Model::Transition out;
  EXPECT_EQ(Model(F, F, 100 * millisecond).transition(year, out), Status::numerical);
}

TEST(DiscreteModel, IsNumericalWhereTheNoiseAloneOverflows) {
  const Eigen::Matrix3d F = Eigen::Matrix3d::Identity(), Q = 1e308 * F;
  Model::Transition out;
  EXPECT_EQ(Model(F, Q, second).transition(second, out), Status::ok);
  EXPECT_EQ(Model(F, Q, second).transition(2 * second, out), Status::numerical);
}

}  // namespace
}  // namespace surefix
