#include "surefix/core/sensor.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>

#include "systems.hpp"

namespace surefix {
namespace {

using namespace test;

constexpr double infinity = std::numeric_limits<double>::infinity();
const double not_a_number = std::nan("");

TEST(GaussMarkov, KeepsItsStationaryVariance) {
  const GaussMarkov error{0.3, 20.0};
  for (double dt : {0.0, 1e-9, 0.1, 20.0, 1e9}) {
    const double phi = error.decay(dt);
    EXPECT_NEAR(phi * phi * 0.09 + error.noise(dt), 0.09, 1e-16) << dt;
  }
}

TEST(GaussMarkov, TwoDurationsAreOneAfterTheOther) {
  const GaussMarkov error{0.3, 20.0};
  const double a = 3.0, b = 11.0, phi = error.decay(b);
  EXPECT_NEAR(error.decay(a) * phi, error.decay(a + b), 1e-16);
  EXPECT_NEAR(phi * phi * error.noise(a) + error.noise(b), error.noise(a + b), 1e-16);
}

TEST(GaussMarkov, GainsNoiseInTheShortestTime) {
  const GaussMarkov error{2.0, 1e6};
  EXPECT_NEAR(error.noise(1e-9) / (4.0 * 2e-15), 1.0, 1e-12);  // σ² 2 Δt/τ, no cancellation
}

TEST(GaussMarkov, OfInfiniteTimeIsConstant) {
  const GaussMarkov error{2.0, infinity};
  for (double dt : {0.0, 1.0, 3e7}) {
    EXPECT_EQ(error.decay(dt), 1.0);
    EXPECT_EQ(error.noise(dt), 0.0);
  }
}

TEST(GaussMarkov, IsPresentOnlyWithASigma) {
  EXPECT_FALSE(GaussMarkov{}.present());
  EXPECT_FALSE((GaussMarkov{0.0, 10.0}.present()));
  EXPECT_TRUE((GaussMarkov{1e-9, 10.0}.present()));
}

TEST(GaussMarkov, ChecksItsParameters) {
  const auto check = [](double sigma, double time) { return GaussMarkov{sigma, time}.check(); };
  EXPECT_EQ(check(0.0, infinity), ConfigStatus::ok);
  EXPECT_EQ(check(1.0, 5.0), ConfigStatus::ok);
  EXPECT_EQ(check(-1.0, 5.0), ConfigStatus::negative);
  EXPECT_EQ(check(not_a_number, 5.0), ConfigStatus::not_finite);
  EXPECT_EQ(check(infinity, 5.0), ConfigStatus::not_finite);
  EXPECT_EQ(check(1e200, 5.0), ConfigStatus::not_finite) << "its variance is infinite";
  EXPECT_EQ(check(1.0, not_a_number), ConfigStatus::not_finite);
  EXPECT_EQ(check(1.0, 0.0), ConfigStatus::not_positive);
  EXPECT_EQ(check(1.0, -infinity), ConfigStatus::not_positive);
}

TEST(Sensor, ChecksItsParameters) {
  using Speed = Sensor<Eigen::Vector2d>;
  const Speed good = sensor<SpeedSystem>(Eigen::Vector2d{1.0, 0.0}, 1.0);
  EXPECT_EQ(good.check(), ConfigStatus::ok);
  const auto check = [&](auto change) {
    Speed bad = good;
    change(bad);
    return bad.check();
  };
  EXPECT_EQ(check([](Speed& s) { s.observes(1) = not_a_number; }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Speed& s) { s.sigma = infinity; }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Speed& s) { s.sigma = not_a_number; }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Speed& s) { s.sigma = 0.0; }), ConfigStatus::not_positive);
  EXPECT_EQ(check([](Speed& s) { s.sigma = -1.0; }), ConfigStatus::not_positive);
  // The filter computes with the variance: it must be a number, and one that can be divided by.
  EXPECT_EQ(check([](Speed& s) { s.sigma = 1e200; }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Speed& s) { s.sigma = 1e-170; }), ConfigStatus::not_positive);
  EXPECT_EQ(check([](Speed& s) { s.sigma = 1e-155; }), ConfigStatus::not_positive) << "subnormal";
  EXPECT_EQ(check([](Speed& s) { s.sigma = 1e-150; }), ConfigStatus::ok);
  EXPECT_EQ(check([](Speed& s) { s.sigma = 1e150; }), ConfigStatus::ok);
  EXPECT_EQ(check([](Speed& s) { s.latency = 1'000'001 * second; }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Speed& s) { s.latency = -1'000'001 * second; }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Speed& s) { s.latency = -second; }), ConfigStatus::ok);
  EXPECT_EQ(check([](Speed& s) { s.scale.sigma = -1.0; }), ConfigStatus::negative);
  EXPECT_EQ(check([](Speed& s) { s.bias.time = 0.0; }), ConfigStatus::not_positive);
}

}  // namespace
}  // namespace surefix
