#include "surefix/robust/filter.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "columns.hpp"
#include "robust/faults.hpp"
#include "surefix/desync/filter.hpp"

namespace surefix::robust {
namespace {

using namespace test;

using Speed = Filter<SpeedFaults, 64>;

Speed speed_filter(Carry::Kind kind = Carry::Kind::merge, int components = 27) {
  return {speed_setup(kind, components), broad(speed_system(), 20.0, 4.0), 0};
}

/// A measurement of each sensor ten times a second around 20 m/s, sensor 2 off by `bias`.
template <class F>
void push_step(F& filter, Random& random, int step, double bias = 0.0) {
  const SpeedSystem system = speed_system();
  for (int i = 0; i < 8; ++i)
    for (int s = 0; s < 3; ++s) {
      const Time valid = (step * 8 + i) * 100 * millisecond + (s + 1) * 7 * millisecond;
      const double value = 20.0 + (s == 2 ? bias : 0.0) + system.sensor(s).sigma * random.normal();
      EXPECT_EQ(filter.push(valid + system.sensor(s).latency, s, value, 0), Status::ok);
    }
}

TEST(RobustFilter, WithoutFaultModesIsTheLinearFilter) {
  const SpeedSystem system = speed_system();
  using NoFaults = FaultSystem<SpeedSystem, 0>;
  const std::vector<SensorModes> none(3);
  FilterSetup<NoFaults> setup{NoFaults(system),
                              {},
                              {},
                              {Carry::Kind::merge, 1, 0.0, 1.0},
                              {{1.0, 0.0}, 1e-11, Sides::both}};
  ASSERT_EQ(setup.system.make(none), ConfigStatus::ok);
  ASSERT_EQ(setup.table.make(none, 3), ConfigStatus::ok);
  ASSERT_EQ(setup.prior.make(ModePrior::Kind::chains, none), ConfigStatus::ok);
  Filter<NoFaults, 64> robust(setup, broad(system), 0);
  desync::Filter<SpeedSystem, 64> linear(system, broad(system), 0);
  Random random(1), same(1);
  for (int step = 0; step < 20; ++step) {
    push_step(robust, random, step);
    push_step(linear, same, step);
    RobustEstimate estimate;
    desync::StepError error;
    const Time time = (step + 1) * 800 * millisecond;
    ASSERT_EQ(robust.estimate(time, estimate), Status::ok);
    ASSERT_EQ(linear.estimate(time, error), Status::ok);
    const auto& belief = linear.state().belief;
    for (int i = 0; i < 2; ++i) EXPECT_NEAR(estimate.x[i], belief.x(i), 1e-12);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(estimate.P[i], belief.P(i), 1e-12);
    EXPECT_NEAR(estimate.sse, error.sse, 1e-10);
    EXPECT_EQ(estimate.degrees, error.degrees);
    EXPECT_NEAR(estimate.upper, belief.x(0) + 6.8065 * std::sqrt(belief.P(0, 0)), 1e-3);
  }
  EXPECT_NEAR(robust.recursion().log_likelihood(), linear.state().likelihood.value(), 1e-9);
}

TEST(RobustFilter, NamesTheFaultySensorAndHoldsTheTruth) {
  for (const auto kind : {Carry::Kind::merge, Carry::Kind::cut, Carry::Kind::one_gaussian}) {
    Speed filter = speed_filter(kind, 200);
    Random random(2);
    for (int step = 0; step < 20; ++step) {
      const bool faulty = step >= 8 && step < 14;
      push_step(filter, random, step, faulty ? 5.0 : 0.0);
      RobustEstimate estimate;
      ASSERT_EQ(filter.estimate((step + 1) * 800 * millisecond, estimate), Status::ok);
      EXPECT_LT(estimate.lower, 20.0);
      EXPECT_GT(estimate.upper, 20.0);
      const double* modes = estimate.mode_probability + 2 * SensorModes::max_modes;
      EXPECT_NEAR(modes[0] + modes[1] + modes[2], 1.0, 1e-12);
      const double probability = modes[1] + modes[2];
      EXPECT_GT(probability, faulty ? 0.99 : 0.0) << "step " << step;
      EXPECT_LT(probability, step > 3 && step < 8 ? 0.05 : 1.0 + 1e-12) << "step " << step;
    }
  }
}

TEST(RobustFilter, ClaimsNoLimitsThatTheCutMassForbids) {
  FilterSetup<SpeedFaults> setup = speed_setup(Carry::Kind::cut, 1);
  Speed filter(setup, broad(speed_system(), 20.0, 4.0), 0);
  Random random(3);
  for (int step = 0; step < 3; ++step) {
    push_step(filter, random, step);
    RobustEstimate estimate;
    ASSERT_EQ(filter.estimate((step + 1) * 800 * millisecond, estimate), Status::ok);
    if (step == 0) continue;
    EXPECT_GT(estimate.discarded, 1e-11);
    EXPECT_EQ(estimate.lower, -std::numeric_limits<double>::infinity());
    EXPECT_EQ(estimate.upper, std::numeric_limits<double>::infinity());
  }
}

TEST(RobustFilter, CountsThePriorOfMoreFaultsThanTheTableHas) {
  FilterSetup<SpeedFaults> setup = speed_setup();
  ASSERT_EQ(setup.table.make(setup.system.modes(), 1), ConfigStatus::ok);
  Speed filter(setup, broad(speed_system(), 20.0, 4.0), 0);
  RobustEstimate estimate;
  ASSERT_EQ(filter.estimate(800 * millisecond, estimate), Status::ok);
  // Stationary: p healthy = 1/(1 + λ₁d₁ + λ₂d₂); what two or three faulty sensors have is cut.
  const double healthy = 1.0 / (1.0 + 0.005 * 1.0 + 0.005 * 5.0), faulty = 1.0 - healthy;
  EXPECT_NEAR(estimate.discarded, 3.0 * healthy * faulty * faulty + faulty * faulty * faulty,
              1e-14);
}

TEST(RobustFilter, AnswersBadInputAndStaysAsItWas) {
  Speed filter = speed_filter();
  EXPECT_EQ(filter.push(0, 3, 1.0, 0), Status::unknown_sensor);
  EXPECT_EQ(filter.push(0, 0, std::nan(""), 0), Status::not_finite);
  EXPECT_EQ(filter.push(0, 0, 1e31, 0), Status::not_finite);
  EXPECT_EQ(filter.push(-1, 0, 1.0, 0), Status::too_late);
  EXPECT_EQ(filter.push(second, 0, 20.0, 0), Status::ok);
  EXPECT_EQ(filter.push(second, 0, 20.0, 0), Status::repeated);
  RobustEstimate estimate;
  ASSERT_EQ(filter.estimate(second, estimate), Status::ok);
  const double upper = estimate.upper;
  RobustEstimate other;
  EXPECT_EQ(filter.estimate(0, other), Status::time_backwards);
  EXPECT_EQ(filter.estimate(max_time + 1, other), Status::not_finite);
  EXPECT_EQ(filter.recursion().time(), second);
  ASSERT_EQ(filter.estimate(second, estimate), Status::ok);  // a step of no length changes nothing
  EXPECT_NEAR(estimate.upper, upper, 1e-9);
  EXPECT_EQ(filter.counters()[Status::not_finite], 3);
}

TEST(RobustFilter, RestoreRefusesMoreThanItHasRoomFor) {
  Speed filter = speed_filter();
  RobustEstimate estimate;
  ASSERT_EQ(filter.estimate(second, estimate), Status::ok);
  const std::vector<Measurement> waiting(65, Measurement{2 * second, 20.0, 0, 0});
  const MixtureState state = filter.recursion().state();
  EXPECT_EQ(filter.restore(state, true, 0, Counters(), waiting.data(), waiting.size()),
            Status::buffer_full);
  EXPECT_EQ(filter.recursion().time(), second);
}

/// A variance of 1e300 for the acceleration overflows within eleven days.
template <class F>
void expect_refused(F& filter) {
  const Time far = 1'000'000 * second;
  ASSERT_EQ(filter.push(far, 0, 20.0, 0), Status::ok);
  RobustEstimate estimate;
  EXPECT_EQ(filter.estimate(far, estimate), Status::numerical);
  EXPECT_EQ(filter.recursion().time(), 0);
  EXPECT_EQ(filter.recursion().state().components.count(), 1u);
  EXPECT_EQ(filter.recursion().state().components.P(0)[0], 1e300);
}

TEST(RobustFilter, RefusesAPredictionThatOverflows) {
  Speed filter(speed_setup(), broad(speed_system(), 20.0, 1e300), 0);
  expect_refused(filter);
}

TEST(RobustFilter, RefusesItWithHypothesesPerMeasurementToo) {
  using System = FaultSystem<SpeedSystem, 0>;
  const std::vector<SensorModes> healthy(3);
  FilterSetup<System> setup{System(speed_system()), {}, {}, {}, {{1.0, 0.0}, 1e-11, Sides::both}};
  setup.per_measurement.capacity = 16;
  setup.per_measurement.prior.assign(3, {std::log(0.99), std::log(0.01 / 100.0)});
  ASSERT_EQ(setup.system.make(healthy), ConfigStatus::ok);
  ASSERT_EQ(setup.table.make(healthy, 0), ConfigStatus::ok);
  ASSERT_EQ(setup.prior.make(ModePrior::Kind::constant, healthy), ConfigStatus::ok);
  Filter<System, 64> filter(setup, broad(speed_system(), 20.0, 1e300), 0);
  expect_refused(filter);
}

/// What a batch of a filter chosen at run time made at `times`, and of its rows.
struct Batch {
  Batch(const std::vector<Row>& log, const std::vector<Time>& times) {
    AnySettings settings;
    settings.modes.assign(3, modes({outage()}));
    settings.limits = {{1.0, 0.0}, 1e-7, Sides::both};
    const AnySystem system = any_speed_system();
    const auto initial =
        any_belief(Eigen::Vector2d(20.0, 0.0), 100.0 * Eigen::MatrixXd::Identity(2, 2));
    ConfigStatus made{};
    const auto filter = AnyFilter::make(system, initial, settings, std::nullopt, 64, made);
    EXPECT_EQ(made, ConfigStatus::ok);
    surefix::test::Columns columns(system, log, 8);
    double lower[8], upper[8], discarded[8];
    std::vector<double> probability(8 * 3 * SensorModes::max_modes);
    std::int32_t hypothesis[8];
    std::vector<std::int64_t> estimate(log.size());
    const BatchOutput out{columns.time.data(),
                          columns.x.data(),
                          columns.P.data(),
                          lower,
                          upper,
                          probability.data(),
                          hypothesis,
                          discarded,
                          columns.sse.data(),
                          columns.degrees.data(),
                          columns.status.data(),
                          estimate.data(),
                          nullptr,
                          nullptr,
                          nullptr};
    const PreparedLog prepared = filter->prepare(columns.view(), columns.status.data());
    start = prepared.start;
    summary = filter->run(prepared, {times.data(), times.size(), desync::NoiseScope::none}, out);
    rows = columns.status;
  }

  Time start = 0;
  BatchSummary summary;
  std::vector<Status> rows;
};

TEST(RobustFilter, ABatchSaysWhatBecameOfRowsAndTimes) {
  const std::vector<Row> log{{second, 0, 20.0}, {2 * second, 0, 20.0}, {9 * second, 0, 20.0}};
  Batch found(log, {2 * second, 3 * second});
  EXPECT_EQ(found.summary.estimates, 2u);
  EXPECT_EQ(found.start, second);
  EXPECT_EQ(found.rows, (std::vector<Status>{Status::ok, Status::ok, Status::waiting}));
  found = Batch(log, {2 * second, max_time + 1});
  EXPECT_EQ(found.summary.status, Status::not_finite);
  EXPECT_EQ(found.summary.estimates, 1u);
  found = Batch({}, {});  // neither rows nor times
  EXPECT_EQ(found.summary.status, Status::ok);
  EXPECT_EQ(found.summary.estimates, 0u);
  EXPECT_EQ(found.start, 0);
  std::vector<Time> no_times;
  no_times.reserve(1);  // an array, and none in it: not the same as no array
  found = Batch(log, no_times);
  EXPECT_EQ(found.summary.status, Status::ok);
  EXPECT_EQ(found.summary.estimates, 0u);
  EXPECT_EQ(found.rows, std::vector<Status>(3, Status::waiting));
}

TEST(RobustFilter, TakesGrossValuesForOutages) {
  Speed filter = speed_filter();
  Random random(5);
  push_step(filter, random, 0);
  EXPECT_EQ(filter.push(750 * millisecond, 0, 1e29, 0), Status::ok);
  RobustEstimate estimate;
  ASSERT_EQ(filter.estimate(800 * millisecond, estimate), Status::ok);
  EXPECT_NEAR(estimate.x[0], 20.0, 1.0);
  EXPECT_GT(estimate.mode_probability[1], 0.999);
  EXPECT_TRUE(std::isfinite(estimate.upper));
}

}  // namespace
}  // namespace surefix::robust
