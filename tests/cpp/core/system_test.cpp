#include "surefix/core/system.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "dense.hpp"
#include "systems.hpp"

namespace surefix {
namespace {

using namespace test;

using Speed = Eigen::Vector2d;
const Speed reads_speed{1.0, 0.0};

/// The row of a sensor at `x`, as a dense vector.
template <class System, class Vector>
Eigen::VectorXd row(const System& system, int index, const Vector& x) {
  const int n = system.state_size();
  Eigen::VectorXd h = Eigen::VectorXd::Zero(n);
  typename System::Belief unused{x, System::Belief::Matrix::Zero(n, n)};
  return system.with_row(index, system.read(index, x).at, unused, [&](const auto& r, auto&) {
    r.for_each([&](int i, double coefficient) { h(i) += coefficient; });
    return h;
  });
}

template <class System, class Vector>
double reading(const System& system, int index, const Vector& x) {
  return system.read(index, x).predicted;
}

TEST(System, LaysScaleAndBiasStatesBehindTheModelsInTheOrderOfTheSensors) {
  const AnySystem system = train_system();
  EXPECT_EQ(system.model_size(), 3);
  EXPECT_EQ(system.state_size(), 6);
  EXPECT_EQ(system.sensor_count(), 3);
  EXPECT_EQ(system.scale_state(0), 3);
  EXPECT_EQ(system.bias_state(0), 4);
  EXPECT_EQ(system.scale_state(1), -1);
  EXPECT_EQ(system.bias_state(1), -1);
  EXPECT_EQ(system.scale_state(2), -1);
  EXPECT_EQ(system.bias_state(2), 5);
}

TEST(System, PredictsScaleTimesLevelPlusBias) {
  const AnySystem system = train_system();
  AnySystem::Belief::Vector x(6);
  x << 1000.0, 30.0, 0.5, 0.01, 0.2, -4.0;
  EXPECT_DOUBLE_EQ(reading(system, 0, x), 1.01 * 30.0 + 0.2);
  EXPECT_DOUBLE_EQ(reading(system, 1, x), 30.0);
  EXPECT_DOUBLE_EQ(reading(system, 2, x), 1000.0 - 4.0);
}

TEST(System, RowsAreTheDerivativesOfTheReadings) {
  AnySystem system = train_system();
  const Eigen::Vector3d mixed{0.1, -2.0, 0.7};
  ASSERT_EQ(system.add(sensor<AnySystem>(mixed, 1.0, 0, {0.1}, {0.1})), ConfigStatus::ok);
  Random random(15);
  const AnySystem::Belief::Vector x = random_matrix(random, system.state_size(), 1);
  for (int s = 0; s < system.sensor_count(); ++s) {
    const Eigen::VectorXd h = row(system, s, x);
    for (int i = 0; i < system.state_size(); ++i) {
      const double step = 1e-4;
      AnySystem::Belief::Vector above = x, below = x;
      above(i) += step;
      below(i) -= step;
      const double slope = (reading(system, s, above) - reading(system, s, below)) / (2.0 * step);
      EXPECT_NEAR(h(i), slope, 1e-10) << "sensor " << s << ", state " << i;
    }
  }
}

TEST(System, RowsOfAFixedSizeAreThoseOfTheSizeKnownAtRunTime) {
  System<ConstantAccelerationWithPosition, 3, 3, 4> fixed{ConstantAccelerationWithPosition(0.08)};
  const AnySystem any = train_system();
  for (int s = 0; s < any.sensor_count(); ++s) {
    const auto& a = any.sensor(s);
    const Eigen::Vector3d observes = a.observes;
    ASSERT_EQ(fixed.add(sensor<decltype(fixed)>(observes, a.sigma, a.latency, a.scale, a.bias)),
              ConfigStatus::ok);
  }
  ASSERT_EQ(fixed.check(), ConfigStatus::ok);
  Random random(16);
  const Eigen::Matrix<double, 6, 1> x = random_matrix(random, 6, 1);
  const AnySystem::Belief::Vector any_x = x;
  for (int s = 0; s < 3; ++s) {
    EXPECT_TRUE(same_bits(row(fixed, s, x), row(any, s, any_x)));
    EXPECT_TRUE(same_bits(reading(fixed, s, x), reading(any, s, any_x)));
  }
}

TEST(System, SensorStatesDecayAsGaussMarkovProcesses) {
  const AnySystem system = train_system();
  AnySystem::Transition transition;
  ASSERT_EQ(system.transition(5 * second, transition), Status::ok);
  const FQ actual = dense(transition, 6);
  ChainTransition<3> chain;
  ASSERT_EQ(ConstantAccelerationWithPosition(0.08).transition(5 * second, chain), Status::ok);
  const FQ model = dense(chain, 3);

  Eigen::MatrixXd F = Eigen::MatrixXd::Zero(6, 6), Q = F;
  F.topLeftCorner(3, 3) = model.F;
  Q.topLeftCorner(3, 3) = model.Q;
  const double scale = std::exp(-5.0 / 600.0), bias = std::exp(-5.0 / 10.0);
  F.diagonal().tail(3) << scale, bias, 1.0;
  Q.diagonal().tail(3) << 4e-4 * (1.0 - scale * scale), 0.01 * (1.0 - bias * bias), 0.0;
  EXPECT_LT(error(actual.F, F), 1e-15);
  EXPECT_LT((actual.Q - Q).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT(error(dense_transposed(transition, 6), F.transpose()), 1e-15);
}

TEST(System, StartsItsSensorStatesInTheirStationaryDistribution) {
  const AnySystem system = train_system();
  const Eigen::Vector3d x{1.0, 2.0, 3.0};
  Random random(17);
  const Eigen::Matrix3d P = random_covariance(random, 3);
  const AnySystem::Belief belief = system.initial({x, P});
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(6, 6);
  expected.topLeftCorner(3, 3) = P;
  expected.diagonal().tail(3) << 0.02 * 0.02, 0.1 * 0.1, 2.0 * 2.0;
  EXPECT_TRUE(same_bits(belief.x.head(3), x));
  EXPECT_TRUE(belief.x.tail(3).isZero(0.0));
  EXPECT_TRUE(same_bits(belief.P, expected));
}

/// What must not change when `add` fails.
template <class System>
void expect_refused(System& system, const typename System::SensorType& bad, ConfigStatus why) {
  const int sensors = system.sensor_count(), states = system.state_size();
  EXPECT_EQ(system.add(bad), why);
  EXPECT_EQ(system.sensor_count(), sensors);
  EXPECT_EQ(system.state_size(), states);
}

TEST(System, AddRefusesABadSensorAndStaysAsItWas) {
  AnySystem system = train_system();
  const Eigen::Vector3d speed{0.0, 1.0, 0.0};
  const auto good = sensor<AnySystem>(speed, 1.0, 0, {0.1}, {0.1});
  auto bad = good;
  bad.observes = speed.head(2);
  expect_refused(system, bad, ConfigStatus::wrong_size);
  bad = good;
  bad.observes(0) = std::nan("");
  expect_refused(system, bad, ConfigStatus::not_finite);
  bad = good;
  bad.sigma = 0.0;
  expect_refused(system, bad, ConfigStatus::not_positive);
  bad = good;
  bad.scale.sigma = -0.1;
  expect_refused(system, bad, ConfigStatus::negative);
  bad = good;
  bad.bias.time = 0.0;
  expect_refused(system, bad, ConfigStatus::not_positive);

  ASSERT_EQ(system.add(good), ConfigStatus::ok);
  EXPECT_EQ(system.scale_state(3), 6);
  EXPECT_EQ(system.bias_state(3), 7);
}

TEST(System, AddRefusesMoreSensorsThanItHasRoomFor) {
  System<ConstantAcceleration, 0, 0, 2> system{ConstantAcceleration(0.1)};
  const auto wheel = sensor<decltype(system)>(reads_speed, 1.0);
  ASSERT_EQ(system.add(wheel), ConfigStatus::ok);
  ASSERT_EQ(system.add(wheel), ConfigStatus::ok);
  expect_refused(system, wheel, ConfigStatus::too_many_sensors);
}

TEST(System, AddRefusesMoreErrorStatesThanItHasRoomFor) {
  System<ConstantAcceleration, 1> system{ConstantAcceleration(0.1)};
  const auto plain = sensor<decltype(system)>(reads_speed, 1.0);
  auto both = plain, biased = plain;
  biased.bias.sigma = both.bias.sigma = both.scale.sigma = 0.1;
  expect_refused(system, both, ConfigStatus::sensor_states);
  ASSERT_EQ(system.add(biased), ConfigStatus::ok);
  expect_refused(system, biased, ConfigStatus::sensor_states);
  ASSERT_EQ(system.add(plain), ConfigStatus::ok);
}

TEST(System, ChecksThatItsSensorsFillItsFixedSize) {
  System<ConstantAcceleration, 1> system{ConstantAcceleration(0.1)};
  auto wheel = sensor<decltype(system)>(reads_speed, 1.0);
  EXPECT_EQ(system.check(), ConfigStatus::sensor_states);
  ASSERT_EQ(system.add(wheel), ConfigStatus::ok);
  EXPECT_EQ(system.check(), ConfigStatus::sensor_states);
  wheel.bias.sigma = 0.1;
  ASSERT_EQ(system.add(wheel), ConfigStatus::ok);
  EXPECT_EQ(system.check(), ConfigStatus::ok);
  EXPECT_EQ(train_system().check(), ConfigStatus::ok);
}

TEST(System, ChecksItsModel) {
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
  const auto check = [](const auto& model) {
    return System<std::decay_t<decltype(model)>>(model).check();
  };
  EXPECT_EQ(check(ConstantAcceleration(0.1)), ConfigStatus::ok);
  EXPECT_EQ(check(ConstantAcceleration(-0.1)), ConfigStatus::negative);
  EXPECT_EQ(check(LinearModel<2>(one, -one)), ConfigStatus::not_semidefinite);
  EXPECT_EQ(check(DiscreteModel<2>(one, one, 0)), ConfigStatus::not_positive);
  EXPECT_EQ(AnySystem{AnyModel(ConstantVelocity(-0.1))}.check(), ConfigStatus::negative);
}

TEST(System, IsTheSpeedSystemOnlyIfAllReadThePlainSpeed) {
  const auto is_speed = [](const AnySystem& system) {
    SpeedSystem out{ConstantAcceleration(1.0)};
    return as_speed_system(system, out);
  };
  AnySystem system = any_speed_system();
  EXPECT_TRUE(is_speed(system));
  AnySystem with_bias = system, of_acceleration = system, doubled = system, mixed = system;
  ASSERT_EQ(with_bias.add(sensor<AnySystem>(reads_speed, 1.0, 0, {}, {0.1})), ConfigStatus::ok);
  ASSERT_EQ(of_acceleration.add(sensor<AnySystem>(Speed{0.0, 1.0}, 1.0)), ConfigStatus::ok);
  ASSERT_EQ(doubled.add(sensor<AnySystem>(Speed{2.0, 0.0}, 1.0)), ConfigStatus::ok);
  ASSERT_EQ(mixed.add(sensor<AnySystem>(Speed{1.0, 0.5}, 1.0)), ConfigStatus::ok);
  EXPECT_FALSE(is_speed(with_bias));
  EXPECT_FALSE(is_speed(of_acceleration));
  EXPECT_FALSE(is_speed(doubled));
  EXPECT_FALSE(is_speed(mixed));
  EXPECT_FALSE(is_speed(AnySystem{AnyModel(ConstantVelocityWithPosition(0.1))}));
}

TEST(System, TheSpeedSystemKeepsEverySensor) {
  SpeedSystem speed{ConstantAcceleration(1.0)};
  const AnySystem any = any_speed_system();
  ASSERT_TRUE(as_speed_system(any, speed));
  ASSERT_EQ(speed.sensor_count(), any.sensor_count());
  for (int s = 0; s < any.sensor_count(); ++s) {
    EXPECT_EQ(speed.sensor(s).sigma, any.sensor(s).sigma);
    EXPECT_EQ(speed.sensor(s).latency, any.sensor(s).latency);
  }
  ChainTransition<2> expected, actual;
  ASSERT_EQ(ConstantAcceleration(0.08).transition(second, expected), Status::ok);
  ASSERT_EQ(speed.model().transition(second, actual), Status::ok);
  EXPECT_TRUE(same_bits(dense(actual, 2).Q, dense(expected, 2).Q));
}

template <class Model>
void expect_reads_the_sum(const Model& model) {
  System<Model> system{model};
  ASSERT_EQ(system.add(sensor<System<Model>>(Eigen::Vector2d{1.0, 1.0}, 1.0)), ConfigStatus::ok);
  EXPECT_EQ(reading(system, 0, Eigen::Vector2d{2.0, 3.0}), 5.0);
}

TEST(System, TakesEveryModelOfTheLibrary) {
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
  expect_reads_the_sum(ConstantAcceleration(0.1));
  expect_reads_the_sum(LinearModel<2>(one, one));
  expect_reads_the_sum(DiscreteModel<2>(one, one, second));
}

}  // namespace
}  // namespace surefix
