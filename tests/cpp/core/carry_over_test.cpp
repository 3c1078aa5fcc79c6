#include "surefix/core/carry_over.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "dense.hpp"
#include "systems.hpp"

namespace surefix {
namespace {

using namespace test;

/// A belief of the train system in which everything is correlated with everything.
AnySystem::Belief correlated() {
  Random random(18);
  return {random_matrix(random, 6, 1), random_covariance(random, 6)};
}

AnySystem::SensorType beacon() {
  return sensor<AnySystem>(Eigen::Vector3d{1.0, 0.0, 0.0}, 1.0, 0, {0.5}, {0.25});
}

/// The entries of `from` at `index`.
void expect_part(const AnySystem::Belief& part, const AnySystem::Belief& whole,
                 const std::vector<int>& index) {
  for (std::size_t i = 0; i < index.size(); ++i) {
    EXPECT_EQ(part.x(static_cast<int>(i)), whole.x(index[i]));
    for (std::size_t j = 0; j < index.size(); ++j)
      EXPECT_EQ(part.P(static_cast<int>(i), static_cast<int>(j)), whole.P(index[i], index[j]));
  }
}

TEST(CarryOver, ToTheSameSystemChangesNothing) {
  const AnySystem system = train_system();
  const auto belief = correlated();
  EXPECT_TRUE(same_belief(carry_over(system, belief, system, [](int s) { return s; }), belief));
}

TEST(CarryOver, ANewSensorsStatesAreStationaryAndIndependent) {
  AnySystem larger = train_system();
  ASSERT_EQ(larger.add(beacon()), ConfigStatus::ok);
  const auto belief = correlated();
  const auto to = carry_over(train_system(), belief, larger, [](int s) { return s < 3 ? s : -1; });
  ASSERT_EQ(to.size(), 8);
  EXPECT_TRUE(same_bits(to.x.head(6), belief.x));
  EXPECT_TRUE(same_bits(to.P.topLeftCorner(6, 6), belief.P));
  EXPECT_TRUE(to.x.tail(2).isZero(0.0));
  EXPECT_TRUE(to.P.bottomLeftCorner(2, 6).isZero(0.0));
  EXPECT_TRUE(to.P.topRightCorner(6, 2).isZero(0.0));
  EXPECT_EQ(to.P(6, 6), 0.25);
  EXPECT_EQ(to.P(7, 7), 0.0625);
  EXPECT_EQ(to.P(6, 7), 0.0);
}

TEST(CarryOver, ARemovedSensorsStatesAreMarginalisedOut) {
  const AnySystem old = train_system();
  AnySystem smaller{old.model()};
  ASSERT_EQ(smaller.add(old.sensor(2)), ConfigStatus::ok);  // the wheel is gone
  const auto belief = correlated();
  const auto to = carry_over(old, belief, smaller, [](int) { return 2; });
  ASSERT_EQ(to.size(), 4);
  expect_part(to, belief, {0, 1, 2, 5});
}

TEST(CarryOver, FollowsSensorsThatChangePlaces) {
  const AnySystem old = train_system();
  AnySystem swapped{old.model()};
  ASSERT_EQ(swapped.add(old.sensor(2)), ConfigStatus::ok);
  ASSERT_EQ(swapped.add(old.sensor(0)), ConfigStatus::ok);
  const auto belief = correlated();
  const auto to = carry_over(old, belief, swapped, [](int s) { return s == 0 ? 2 : 0; });
  ASSERT_EQ(to.size(), 6);
  expect_part(to, belief, {0, 1, 2, 5, 3, 4});
}

TEST(CarryOver, ASensorThatLearnsOfItsBiasStartsItStationary) {
  const AnySystem old = train_system();
  AnySystem taught{old.model()};
  auto radar = old.sensor(1);
  radar.bias.sigma = 3.0;
  ASSERT_EQ(taught.add(radar), ConfigStatus::ok);
  const auto to = carry_over(old, correlated(), taught, [](int) { return 1; });
  ASSERT_EQ(to.size(), 4);
  EXPECT_EQ(to.x(3), 0.0);
  EXPECT_EQ(to.P(3, 3), 9.0);
  EXPECT_TRUE(to.P.topRightCorner(3, 1).isZero(0.0));
}

}  // namespace
}  // namespace surefix
