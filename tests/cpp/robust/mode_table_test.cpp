#include <gtest/gtest.h>

#include "robust/faults.hpp"
#include "surefix/robust/mode_prior.hpp"

namespace surefix::robust {
namespace {

using namespace test;

TEST(ModeTable, HasAllCombinationsTheFirstAllHealthy) {
  ModeTable table;
  ASSERT_EQ(table.make({modes({outage(), drifting()}), modes({outage()})}, 2), ConfigStatus::ok);
  ASSERT_EQ(table.count(), 6);
  EXPECT_TRUE(table.complete());
  EXPECT_EQ(table.mode(0, 0) + table.mode(0, 1), 0);
  EXPECT_EQ(table.mode(5, 0), 2);
  EXPECT_EQ(table.mode(5, 1), 1);
}

TEST(ModeTable, MayLimitHowManySensorsAreFaulty) {
  const std::vector<SensorModes> sixteen(16, modes({outage(), drifting(), frozen()}));
  ModeTable table;
  EXPECT_EQ(table.make(sixteen, 16), ConfigStatus::too_many_hypotheses);  // 4^16
  ASSERT_EQ(table.make(sixteen, 2), ConfigStatus::ok);
  EXPECT_EQ(table.count(), 1 + 16 * 3 + 16 * 15 / 2 * 9);
  EXPECT_FALSE(table.complete());
}

TEST(ModePrior, ConstantIsTheProductWhateverWasBefore) {
  const std::vector<SensorModes> sensors(2, modes({outage(), drifting()}));
  ModeTable table;
  ModePrior prior;
  ASSERT_EQ(table.make(sensors, 2), ConfigStatus::ok);
  ASSERT_EQ(prior.make(ModePrior::Kind::constant, sensors), ConfigStatus::ok);
  prior.advance(0.8, false);
  for (int a = 0; a < table.count(); ++a) {
    double total = 0.0;
    for (int b = 0; b < table.count(); ++b) total += std::exp(prior.log_probability(table, a, b));
    EXPECT_NEAR(total, 1.0, 1e-15);
    EXPECT_NEAR(prior.log_probability(table, a, 8), std::log(1e-4), 1e-14);
  }
}

TEST(ModePrior, OfChainsMultipliesTheirTransitions) {
  const std::vector<SensorModes> sensors(2, modes({outage(0.01, 2.0)}));
  ModeTable table;
  ModePrior prior;
  ASSERT_EQ(table.make(sensors, 2), ConfigStatus::ok);
  ASSERT_EQ(prior.make(ModePrior::Kind::chains, sensors), ConfigStatus::ok);
  prior.advance(0.8, false);
  const double fail = -0.01 / 0.51 * std::expm1(-0.51 * 0.8);
  EXPECT_NEAR(prior.log_probability(table, 0, 3), 2.0 * std::log(fail), 1e-13);
  prior.advance(0.8, true);
  const double stationary = 0.01 / 0.51;
  for (int a = 0; a < 4; ++a)
    EXPECT_NEAR(prior.log_probability(table, a, 3), 2.0 * std::log(stationary), 1e-13);
}

TEST(ModePrior, JointLetsSensorsFailTogether) {
  const std::vector<SensorModes> sensors(2, modes({outage()}));
  ModeTable table;
  ModePrior prior;
  ASSERT_EQ(table.make(sensors, 2), ConfigStatus::ok);
  std::vector<double> rates(16, 0.0);
  rates[3] = 1e-3;  // both at once
  rates[12] = 0.5;
  ASSERT_EQ(prior.make_joint(table, rates), ConfigStatus::ok);
  prior.advance(1.0, false);
  EXPECT_NEAR(prior.log_probability(table, 0, 3), std::log(-1e-3 / 0.501 * std::expm1(-0.501)),
              1e-13);
  EXPECT_EQ(prior.log_probability(table, 0, 1), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(prior.make_joint(table, {0.0}), ConfigStatus::wrong_size);
}

TEST(ModePrior, RefusesWhatIsNoDistribution) {
  FaultMode certain = outage(), never = outage(0.0), endless = outage();
  certain.probability = 1.0;
  endless.duration = 0.0;
  ModePrior prior;
  EXPECT_EQ(prior.make(ModePrior::Kind::constant, {modes({certain})}), ConfigStatus::prior);
  EXPECT_EQ(prior.make(ModePrior::Kind::chains, {modes({never})}), ConfigStatus::prior);
  EXPECT_EQ(prior.make(ModePrior::Kind::chains, {modes({endless})}), ConfigStatus::prior);
}

TEST(FaultMode, IsCheckedBeforeItIsTaken) {
  SensorModes sensor;
  FaultMode bad = outage();
  bad.span = 0.0;
  EXPECT_EQ(sensor.add(bad), ConfigStatus::not_positive);
  bad.span = std::nan("");
  EXPECT_EQ(sensor.add(bad), ConfigStatus::not_finite);
  bad = drifting();
  bad.sigma = -1.0;
  EXPECT_EQ(sensor.add(bad), ConfigStatus::negative);
  bad = frozen();
  bad.resolution = 0.0;
  EXPECT_EQ(sensor.add(bad), ConfigStatus::not_positive);
  EXPECT_EQ(sensor.add(drifting()), ConfigStatus::ok);
  EXPECT_EQ(sensor.add(drifting()), ConfigStatus::too_many_modes);
  EXPECT_EQ(sensor.count(), 2);
}

}  // namespace
}  // namespace surefix::robust
