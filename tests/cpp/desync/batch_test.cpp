#include "surefix/desync/batch.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "columns.hpp"
#include "surefix/desync/filter.hpp"

namespace surefix::desync {
namespace {

using namespace test;

/// [speed, acceleration | wheel scale, radar bias] at fixed size.
using ScaleBiasSystem = System<ConstantAcceleration, 2, 2, 4>;

ScaleBiasSystem scale_bias_system() {
  ScaleBiasSystem system{ConstantAcceleration(0.08)};
  const Eigen::Vector2d speed{1.0, 0.0};
  (void)system.add(sensor<ScaleBiasSystem>(speed, 0.1, 0, {0.02, 600.0}));
  (void)system.add(sensor<ScaleBiasSystem>(speed, 0.5, 30 * millisecond, {}, {0.3, 20.0}));
  (void)system.add(sensor<ScaleBiasSystem>(speed, 0.2, 150 * millisecond));
  return system;
}

/// A batch with all that it writes.
template <class System>
struct Ran {
  Columns columns;
  RecursionState<typename System::Belief> state;
  Status status = Status::ok;
  std::size_t made = 0;

  Ran(const System& system, const std::vector<Row>& log, const std::vector<Time>& times,
      NoiseScope scope, Time delay = any_delay)
      : columns(system, log, times.size()), state(start_state(broad(system), second)) {
    const SortedLog sorted(system, columns.view(), columns.status.data());
    status = run_batch(system, state, sorted, {times.data(), times.size(), scope, delay},
                       columns.output(), made);
  }
};

/// The same without times, from the same start.
template <class System>
struct EveryMeasurement {
  Columns columns;
  RecursionState<typename System::Belief> state;
  Status status = Status::ok;
  std::size_t distinct = 0, made = 0;

  EveryMeasurement(const System& system, const std::vector<Row>& log, NoiseScope scope)
      : columns(system, log, log.size()), state(start_state(broad(system), second)) {
    const SortedLog sorted(system, columns.view(), columns.status.data());
    distinct = sorted.distinct_times(second);
    status = run_batch(system, state, sorted, {nullptr, distinct, scope}, columns.output(), made);
  }
};

/// Discrete, with transitions over multiples of 50 ms only.
AnySystem gridded_system() {
  const Eigen::Matrix2d F{{0.9, 0.1}, {0.0, 0.9}}, Q = Eigen::Matrix2d::Identity();
  AnySystem system{AnyModel(AnyModel::Discrete(F, Q, 50 * millisecond))};
  (void)system.add(sensor<AnySystem>(Eigen::Vector2d{1.0, 1.0}, 1.0));
  return system;
}

/// A row that waits at the end of a batch was a push that was ok.
Status as_pushed(Status row) { return row == Status::waiting ? Status::ok : row; }

/// A log in the order of its rows, streamed: every row that is valid by an estimate is pushed
/// before it, so that only what precedes the start is too late.
template <class System>
void expect_streaming_bits(const System& system, std::uint64_t seed) {
  const std::vector<Row> log = random_log(system, 400, seed);
  std::vector<Time> times;
  for (Time t = 1200 * millisecond; t < 12 * second; t += 170 * millisecond) times.push_back(t);
  const Ran<System> batch(system, log, times, NoiseScope::step);
  ASSERT_EQ(batch.status, Status::ok);
  ASSERT_EQ(batch.made, times.size());

  Filter<System, -1> filter(system, broad(system), second);
  filter.reserve(log.size());
  std::vector<Status> status;
  for (std::size_t i = 0; i < log.size(); ++i)
    status.push_back(
        filter.push(log[i].stamp, log[i].sensor, log[i].value, static_cast<std::int64_t>(i)));
  std::vector<double> noise(log.size(), std::nan("")), variance = noise;
  for (std::size_t t = 0; t < times.size(); ++t) {
    StepError error;
    ASSERT_EQ(filter.estimate(times[t], error), Status::ok);
    ASSERT_TRUE(same_bits(batch.columns.mean(t), filter.state().belief.x)) << "estimate " << t;
    ASSERT_TRUE(same_bits(batch.columns.covariance(t), filter.state().belief.P));
    ASSERT_TRUE(same_bits(batch.columns.sse[t], error.sse));
    ASSERT_EQ(batch.columns.degrees[t], error.degrees);
    ASSERT_EQ(batch.columns.time[t], seconds(times[t]));
    filter.noise([&](std::size_t, const NoiseEstimate& e) {
      noise[static_cast<std::size_t>(e.id)] = e.value;
      variance[static_cast<std::size_t>(e.id)] = e.variance;
    });
  }
  EXPECT_TRUE(same_bits(batch.state.likelihood.value(), filter.state().likelihood.value()));
  for (std::size_t i = 0; i < log.size(); ++i) {
    EXPECT_EQ(as_pushed(batch.columns.status[i]), status[i]) << "row " << i;
    EXPECT_TRUE(std::isnan(noise[i]) ? std::isnan(batch.columns.noise[i])
                                     : bits(batch.columns.noise[i]) == bits(noise[i]));
    EXPECT_TRUE(std::isnan(noise[i]) || same_bits(batch.columns.noise_variance[i], variance[i]));
  }
}

TEST(Batch, HasTheBitsOfStreaming) {
  for (std::uint64_t seed : {41, 42, 43}) {
    expect_streaming_bits(speed_system(), seed);
    expect_streaming_bits(scale_bias_system(), seed);
    expect_streaming_bits(train_system(), seed);
  }
}

/// Onboard: the estimate for t is made when the clock says t + delay, and knows of no later stamp.
template <class System>
void expect_delayed_streaming_bits(const System& system, Time delay) {
  const std::vector<Row> log = random_log(system, 400, 49);
  std::vector<Time> times;
  for (Time t = 1200 * millisecond; t < 12 * second; t += 170 * millisecond) times.push_back(t);
  const Ran<System> batch(system, log, times, NoiseScope::none, delay);
  Filter<System, -1> filter(system, broad(system), second);
  filter.reserve(log.size());
  std::vector<Status> status;
  for (std::size_t t = 0; t < times.size(); ++t) {
    for (std::size_t i = status.size(); i < log.size() && log[i].stamp <= times[t] + delay; ++i)
      status.push_back(filter.push(log[i].stamp, log[i].sensor, log[i].value, 0));
    StepError error;
    ASSERT_EQ(filter.estimate(times[t], error), Status::ok);
    ASSERT_TRUE(same_bits(batch.columns.mean(t), filter.state().belief.x)) << "estimate " << t;
    ASSERT_TRUE(same_bits(batch.columns.covariance(t), filter.state().belief.P));
    ASSERT_TRUE(same_bits(batch.columns.sse[t], error.sse));
  }
  for (std::size_t i = 0; i < status.size(); ++i) {
    EXPECT_EQ(as_pushed(batch.columns.status[i]), status[i]) << "row " << i;
  }
}

TEST(Batch, CountsWhatStreamingCounts) {
  const AnySystem system = gridded_system();
  const std::vector<Row> log{{1100 * millisecond, 0, 20.0}, {1125 * millisecond, 0, 21.0},
                             {1150 * millisecond, 9, 20.0}, {1150 * millisecond, 0, 1.7e308},
                             {1200 * millisecond, 0, 22.0}, {1200 * millisecond, 0, 22.0},
                             {900 * millisecond, 0, 20.0},  {5 * second, 0, 20.0}};
  const std::vector<Time> times{1200 * millisecond, 1500 * millisecond};
  const Ran<AnySystem> batch(system, log, times, NoiseScope::none);
  ASSERT_EQ(batch.status, Status::ok);
  Counters expected;
  for (Status status : batch.columns.status) expected.count(as_pushed(status));

  Filter<AnySystem, 8> filter(system, broad(system), second);
  for (const Row& row : log) (void)filter.push(row.stamp, row.sensor, row.value, 0);
  StepError error;
  for (Time time : times) ASSERT_EQ(filter.estimate(time, error), Status::ok);
  for (int i = 0; i < status_count; ++i) {
    const auto status = static_cast<Status>(i);
    EXPECT_EQ(filter.counters()[status], expected[status]) << name(status);
  }
  EXPECT_EQ(expected[Status::ok], 3);
  EXPECT_EQ(expected[Status::off_grid], 1);
  EXPECT_EQ(expected[Status::numerical], 1);
}

TEST(Batch, WithADelayHasTheBitsOfStreamingOnboard) {
  for (Time delay : {Time{0}, 50 * millisecond, 200 * millisecond}) {
    expect_delayed_streaming_bits(speed_system(), delay);
    expect_delayed_streaming_bits(train_system(), delay);
  }
}

TEST(Batch, DoesNotDependOnTheOrderOfTheRows) {
  const SpeedSystem system = speed_system();
  std::vector<Row> log = random_log(system, 300, 44);
  const std::vector<Time> times{3 * second, 6 * second, 20 * second};
  const Ran<SpeedSystem> in_order(system, log, times, NoiseScope::none);
  Random random(45);
  for (std::size_t i = log.size(); i > 1; --i)
    std::swap(log[i - 1], log[static_cast<std::size_t>(random.integer(static_cast<int>(i)))]);
  const Ran<SpeedSystem> shuffled(system, log, times, NoiseScope::none);
  for (std::size_t t = 0; t < times.size(); ++t) {
    EXPECT_TRUE(same_bits(in_order.columns.mean(t), shuffled.columns.mean(t)));
    EXPECT_TRUE(same_bits(in_order.columns.covariance(t), shuffled.columns.covariance(t)));
    EXPECT_TRUE(same_bits(in_order.columns.sse[t], shuffled.columns.sse[t]));
  }
  EXPECT_TRUE(same_bits(in_order.state.likelihood.value(), shuffled.state.likelihood.value()));
}

TEST(Batch, ComputingTheNoiseDoesNotChangeTheEstimates) {
  const AnySystem system = train_system();
  const std::vector<Row> log = random_log(system, 200, 46);
  const std::vector<Time> times{3 * second, 20 * second};
  const Ran<AnySystem> none(system, log, times, NoiseScope::none);
  for (NoiseScope scope : {NoiseScope::step, NoiseScope::journey}) {
    const Ran<AnySystem> run(system, log, times, scope);
    for (std::size_t t = 0; t < times.size(); ++t) {
      EXPECT_TRUE(same_bits(run.columns.mean(t), none.columns.mean(t)));
      EXPECT_TRUE(same_bits(run.columns.covariance(t), none.columns.covariance(t)));
    }
  }
}

TEST(Batch, SaysWhatBecameOfEveryRow) {
  const SpeedSystem system = speed_system();
  constexpr Time far = std::numeric_limits<Time>::max();
  const std::vector<std::pair<Row, Status>> rows{
      {{2 * second, 0, 20.0}, Status::ok},
      {{2 * second, 7, 20.0}, Status::unknown_sensor},
      {{2 * second, -1, 20.0}, Status::unknown_sensor},
      {{2 * second, 0, std::nan("")}, Status::not_finite},
      {{no_time, 0, 20.0}, Status::not_finite},
      {{far, 2, 20.0}, Status::not_finite},
      {{second - 1, 0, 20.0}, Status::too_late},
      {{2 * second, 0, 20.0}, Status::repeated},
      {{2 * second, 0, 21.0}, Status::ok},
      {{5 * second, 0, 20.0}, Status::waiting},
      {{second, 2, 20.0}, Status::too_late},
      {{3 * second, 1, 20.0}, Status::ok},
  };
  std::vector<Row> log;
  for (const auto& row : rows) log.push_back(row.first);
  const Ran<SpeedSystem> run(system, log, {4 * second}, NoiseScope::journey);
  ASSERT_EQ(run.status, Status::ok);
  EXPECT_EQ(run.columns.degrees[0], 3);
  for (std::size_t i = 0; i < log.size(); ++i) {
    EXPECT_EQ(run.columns.status[i], rows[i].second) << "row " << i;
    EXPECT_EQ(std::isnan(run.columns.noise[i]), rows[i].second != Status::ok) << "row " << i;
  }
}

TEST(Batch, WithoutTimesEstimatesAtEveryValidityTime) {
  const SpeedSystem system = speed_system();
  const std::vector<Row> log = random_log(system, 200, 47, 2 * second);
  const EveryMeasurement run(system, log, NoiseScope::none);
  ASSERT_EQ(run.status, Status::ok);
  EXPECT_EQ(run.made, run.distinct);
  std::size_t used = 0;
  for (std::size_t t = 0; t < run.made; ++t) {
    EXPECT_TRUE(t == 0 || run.columns.time[t] > run.columns.time[t - 1]);
    used += static_cast<std::size_t>(run.columns.degrees[t]);
  }
  EXPECT_EQ(used, log.size());
}

TEST(Batch, WithoutTimesMakesNoEstimateWhereNoRowWasUsed) {
  const AnySystem system = gridded_system();
  const std::vector<std::pair<Row, Status>> rows{
      {{1050 * millisecond, 0, 20.0}, Status::ok},
      {{1075 * millisecond, 0, 99.0}, Status::off_grid},
      {{1075 * millisecond, 0, 98.0}, Status::off_grid},
      {{1100 * millisecond, 0, 1.7e308}, Status::numerical},  // ν²/S is infinite
      {{1150 * millisecond, 0, 20.5}, Status::ok},
      {{1150 * millisecond, 0, 1.7e308}, Status::numerical},  // of two rows one is used
      {{1151 * millisecond, 0, 99.0}, Status::off_grid},
  };
  std::vector<Row> log, used;
  for (const auto& row : rows) log.push_back(row.first);
  for (const auto& row : rows)
    if (row.second == Status::ok) used.push_back(row.first);
  for (NoiseScope scope : {NoiseScope::none, NoiseScope::step, NoiseScope::journey}) {
    const EveryMeasurement all(system, log, scope), expected(system, used, scope);
    ASSERT_EQ(all.status, Status::ok);
    ASSERT_EQ(all.made, 2u);
    EXPECT_EQ(expected.made, 2u);
    for (std::size_t i = 0; i < log.size(); ++i)
      EXPECT_EQ(all.columns.status[i], rows[i].second) << "row " << i;
    for (std::size_t t = 0; t < 2; ++t) {
      EXPECT_EQ(all.columns.time[t], expected.columns.time[t]);
      EXPECT_EQ(all.columns.degrees[t], 1);
      EXPECT_TRUE(same_bits(all.columns.mean(t), expected.columns.mean(t)));
      EXPECT_TRUE(same_bits(all.columns.covariance(t), expected.columns.covariance(t)));
    }
    EXPECT_EQ(all.state.time, 1150 * millisecond);
    EXPECT_TRUE(same_bits(all.state.likelihood.value(), expected.state.likelihood.value()));
  }
}

TEST(Batch, WithoutTimesAndWithoutAUsableRowMakesNoEstimate) {
  const EveryMeasurement run(gridded_system(), {{1075 * millisecond, 0, 20.0}}, NoiseScope::step);
  EXPECT_EQ(run.status, Status::ok);
  EXPECT_EQ(run.made, 0u);
  EXPECT_EQ(run.columns.status[0], Status::off_grid);
}

TEST(Batch, StopsAtATimeBeyond95Years) {
  const SpeedSystem system = speed_system();
  for (Time far :
       {max_time + 1, std::numeric_limits<Time>::max(), std::numeric_limits<Time>::min()})
    for (Time delay : {any_delay, second}) {
      const Ran<SpeedSystem> run(system, {{2 * second, 0, 20.0}, {5 * second, 0, 20.0}},
                                 {3 * second, far}, NoiseScope::none, delay);
      EXPECT_EQ(run.status, Status::not_finite);
      EXPECT_EQ(run.made, 1u);
      EXPECT_EQ(run.columns.status[0], Status::ok);
      EXPECT_EQ(run.columns.status[1], Status::waiting) << "not used: there is no estimate";
    }
}

TEST(Batch, StopsWhereTimeRunsBackwards) {
  const SpeedSystem system = speed_system();
  const Ran<SpeedSystem> run(system, random_log(system, 100, 48),
                             {2 * second, 3 * second, 2500 * millisecond, 4 * second},
                             NoiseScope::none);
  EXPECT_EQ(run.status, Status::time_backwards);
  EXPECT_EQ(run.made, 2u);
}

TEST(Batch, RowsAfterTheEstimateThatCouldNotBeMadeAreNotOk) {
  const SpeedSystem system = speed_system();
  const Ran<SpeedSystem> run(system, {{2 * second, 0, 20.0}, {5 * second, 0, 20.0}},
                             {3 * second, second}, NoiseScope::none);
  EXPECT_EQ(run.columns.status[0], Status::ok);
  EXPECT_EQ(run.columns.status[1], Status::waiting);
}

TEST(Batch, OfAnEmptyLogOnlyPredicts) {
  const SpeedSystem system = speed_system();
  const Ran<SpeedSystem> run(system, {}, {second, 2 * second}, NoiseScope::journey);
  EXPECT_EQ(run.status, Status::ok);
  EXPECT_EQ(run.made, 2u);
  EXPECT_TRUE(same_bits(run.columns.mean(0), broad(system).x));
}

}  // namespace
}  // namespace surefix::desync
