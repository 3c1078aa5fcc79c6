#include <gtest/gtest.h>

#include <cmath>

#include "robust/faults.hpp"
#include "surefix/robust/mode_prior.hpp"

namespace surefix::robust {
namespace {

using namespace test;

const double none = std::nan("");

TEST(RobustSettings, CarryIsChecked) {
  const auto check = [](int components, double cut, double memory) {
    return Carry{Carry::Kind::merge, components, cut, memory}.check();
  };
  EXPECT_EQ(check(1, 0.0, 1.0), ConfigStatus::ok);
  EXPECT_EQ(check(0, 0.0, 1.0), ConfigStatus::not_positive);
  EXPECT_EQ(check(1, 0.0, 0.0), ConfigStatus::not_positive);
  EXPECT_EQ(check(1, 0.0, none), ConfigStatus::not_positive);
  EXPECT_EQ(check(1, -1e-9, 1.0), ConfigStatus::negative);
  EXPECT_EQ(check(1, none, 1.0), ConfigStatus::negative);
  EXPECT_EQ(check(1, 1.0, 1.0), ConfigStatus::risk);
}

TEST(RobustSettings, LimitsAreChecked) {
  const auto check = [](std::vector<double> a, double risk) {
    return LimitRequest{std::move(a), risk, Sides::both}.check(2);
  };
  EXPECT_EQ(check({1.0, 0.0}, 1e-11), ConfigStatus::ok);
  EXPECT_EQ(check({1.0}, 1e-11), ConfigStatus::wrong_size);
  EXPECT_EQ(check({1.0, none}, 1e-11), ConfigStatus::not_finite);
  for (const double risk : {0.0, -1.0, 1.0, none})
    EXPECT_EQ(check({1.0, 0.0}, risk), ConfigStatus::risk) << risk;
}

TEST(RobustSettings, FrozenModesNeedTheirResolutionAndChange) {
  EXPECT_EQ(frozen().check(), ConfigStatus::ok);
  FaultMode mode = frozen();
  mode.resolution = 0.0;
  EXPECT_EQ(mode.check(), ConfigStatus::not_positive);
  for (const double change : {0.0, 1.0, 2.0}) {
    mode = frozen();
    mode.change = change;
    EXPECT_EQ(mode.check(), ConfigStatus::not_positive) << change;
  }
  mode = drifting();
  mode.factor = 0.0;
  EXPECT_EQ(mode.check(), ConfigStatus::not_positive);
}

TEST(RobustSettings, ASensorHasSixModesAndOneThatDrifts) {
  SensorModes sensor = modes({outage(), outage(), outage(), drifting()});
  EXPECT_EQ(sensor.add(drifting()), ConfigStatus::too_many_modes);
  ASSERT_EQ(sensor.add(frozen()), ConfigStatus::ok);
  EXPECT_EQ(sensor.add(outage()), ConfigStatus::too_many_modes);
  EXPECT_EQ(sensor.count(), SensorModes::max_modes);
}

TEST(RobustSettings, TheSystemWantsTheModesOfAllSensorsAndAllItsDrifts) {
  SpeedFaults three(speed_system());
  EXPECT_EQ(three.make({modes({drifting()})}), ConfigStatus::wrong_size);
  EXPECT_EQ(three.make(std::vector<SensorModes>(3, modes({outage()}))),
            ConfigStatus::sensor_states);  // made for three that drift
  FaultSystem<SpeedSystem, 2> two(speed_system());
  EXPECT_EQ(two.make(std::vector<SensorModes>(3, modes({drifting()}))),
            ConfigStatus::sensor_states);
  EXPECT_EQ(two.make({modes({drifting()}), modes({}), modes({drifting()})}), ConfigStatus::ok);
  EXPECT_EQ(two.state_size(), 4);
}

TEST(RobustSettings, PriorsAreChecked) {
  ModePrior prior;
  FaultMode impossible = outage();
  impossible.probability = 0.0;
  EXPECT_EQ(prior.make(ModePrior::Kind::constant, {modes({impossible})}), ConfigStatus::prior);
  impossible.probability = 1.0;
  EXPECT_EQ(prior.make(ModePrior::Kind::constant, {modes({impossible})}), ConfigStatus::prior);
  // 3^6 combinations: too many for one chain of all.
  ModeTable table;
  ASSERT_EQ(table.make(std::vector<SensorModes>(6, modes({outage(), drifting()})), 6),
            ConfigStatus::ok);
  EXPECT_EQ(prior.make_joint(table, {}), ConfigStatus::too_many_hypotheses);
  ASSERT_EQ(table.make({modes({outage()})}, 1), ConfigStatus::ok);
  EXPECT_EQ(prior.make_joint(table, {0.0, 1.0}), ConfigStatus::wrong_size);
}

TEST(RobustSettings, TheJointPriorOfAPartialTableLeavesOutWhatItsRowsDoNotHold) {
  const std::vector<SensorModes> two(2, modes({outage()}));
  ModeTable table;
  ModePrior prior;
  ASSERT_EQ(table.make(two, 1), ConfigStatus::ok);  // not both
  ASSERT_EQ(table.count(), 3);
  ASSERT_EQ(prior.make_joint(table, {0.0, 0.1, 0.1, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0}),
            ConfigStatus::ok);
  prior.advance(0.5, false);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(prior.left_out(table, a), 0.0, 1e-15) << a;
  ASSERT_EQ(table.make(two, 2), ConfigStatus::ok);
  EXPECT_EQ(prior.left_out(table, 0), 0.0);
}

TEST(RobustSettings, ATableOfNoSensorsHasOneHypothesis) {
  ModeTable table;
  ASSERT_EQ(table.make({}, 0), ConfigStatus::ok);
  EXPECT_EQ(table.count(), 1);
}

/// Settings of a filter chosen at run time, changed by `change`: what it says of them.
template <class Change>
ConfigStatus made(Change&& change) {
  AnySystem system = any_speed_system();
  while (system.sensor_count() < 8) EXPECT_EQ(system.add(system.sensor(0)), ConfigStatus::ok);
  AnySettings settings;
  settings.modes.assign(8, modes({outage()}));
  settings.limits = {{1.0, 0.0}, 1e-11, Sides::both};
  change(settings);
  const auto initial =
      any_belief(Eigen::Vector2d(20.0, 0.0), 100.0 * Eigen::MatrixXd::Identity(2, 2));
  ConfigStatus status{};
  const auto filter = AnyFilter::make(system, initial, settings, 0, 64, status);
  EXPECT_EQ(filter != nullptr, status == ConfigStatus::ok);
  return status;
}

TEST(RobustSettings, AFilterChosenAtRunTimeSaysWhatItRefuses) {
  EXPECT_EQ(made([](AnySettings&) {}), ConfigStatus::ok);
  EXPECT_EQ(made([](AnySettings& s) { s.limits.risk = 2.0; }), ConfigStatus::risk);
  EXPECT_EQ(made([](AnySettings& s) { s.carry.components = 0; }), ConfigStatus::not_positive);
  EXPECT_EQ(made([](AnySettings& s) {
              s.modes.assign(8, modes({outage(), outage(), outage(), outage(), outage()}));
            }),
            ConfigStatus::too_many_hypotheses);  // 6^8
  EXPECT_EQ(made([](AnySettings& s) {
              s.tree = 64;
              s.modes[1] = modes({frozen()});
            }),
            ConfigStatus::too_many_modes);
  EXPECT_EQ(made([](AnySettings& s) {
              s.tree = 64;
              s.modes[1] = modes({outage(), outage()});
            }),
            ConfigStatus::too_many_modes);
}

}  // namespace
}  // namespace surefix::robust
