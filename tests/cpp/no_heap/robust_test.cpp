#include "no_heap/allocations.hpp"
#include "no_heap/hundred_steps.hpp"
#include "robust/faults.hpp"

namespace surefix::no_heap {
namespace {

using namespace robust;
using robust::test::modes;

TEST_F(NoHeap, InStepsOfTheRobustFilter) {
  const auto carries = {Carry::Kind::merge, Carry::Kind::cut, Carry::Kind::one_gaussian};
  for (const Carry::Kind carry : carries) {
    const SpeedSystem system = speed_system();
    robust::Filter<robust::test::SpeedFaults, 64> filter(robust::test::speed_setup(carry, 60),
                                                         broad(system), 0);
    Random random(103);
    bool ok = false;
    EXPECT_EQ(allocations([&] { ok = hundred_steps<RobustEstimate>(filter, system, random); }), 0);
    EXPECT_TRUE(ok);
  }
}

/// A hundred steps of a filter chosen at run time.
void expect_no_heap(const AnySettings& settings) {
  const AnySystem system = any_speed_system();
  const auto initial =
      any_belief(Eigen::Vector2d(20.0, 0.0), 100.0 * Eigen::MatrixXd::Identity(2, 2));
  ConfigStatus made{};
  const auto filter = robust::AnyFilter::make(system, initial, settings, 0, 64, made);
  ASSERT_EQ(made, ConfigStatus::ok);
  Random random(106);
  bool ok = false;
  EXPECT_EQ(allocations([&] { ok = hundred_steps<RobustEstimate>(*filter, system, random); }), 0);
  EXPECT_TRUE(ok);
}

AnySettings any_settings() {
  AnySettings settings;
  settings.limits = {{1.0, 0.0}, 1e-9, Sides::both};
  return settings;
}

TEST_F(NoHeap, InStepsWithFaultsOfEveryKindChosenAtRunTime) {
  AnySettings settings = any_settings();
  settings.modes = {modes({robust::test::outage(), robust::test::drifting()}),
                    modes({robust::test::frozen()}), modes({robust::test::outage()})};
  expect_no_heap(settings);
}

TEST_F(NoHeap, InStepsWithHypothesesPerMeasurement) {
  AnySettings settings = any_settings();
  settings.modes.assign(3, modes({robust::test::outage()}));
  settings.tree = 64;
  expect_no_heap(settings);
}

}  // namespace
}  // namespace surefix::no_heap
