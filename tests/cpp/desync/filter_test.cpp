#include "surefix/desync/filter.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "dense.hpp"
#include "systems.hpp"

namespace surefix::desync {
namespace {

using namespace test;

using SpeedFilter = Filter<SpeedSystem, 64>;
using AnyStreaming = Filter<AnySystem, -1>;

SpeedFilter speed_filter() {
  const SpeedSystem system = speed_system();
  return {system, broad(system), 0};
}

template <class System>
Filter<System, -1> streaming(const System& system, Time start = 0) {
  Filter<System, -1> filter(system, broad(system), start);
  filter.reserve(1000);
  return filter;
}

template <class F>
StepError estimate(F& filter, Time time) {
  StepError error;
  EXPECT_EQ(filter.estimate(time, error), Status::ok);
  return error;
}

template <class F>
std::vector<NoiseEstimate> noise(const F& filter) {
  std::vector<NoiseEstimate> out(filter.used());
  filter.noise([&](std::size_t i, const NoiseEstimate& e) { out[i] = e; });
  return out;
}

template <class F>
::testing::AssertionResult same_noise(const F& a, const F& b) {
  const auto noise_a = noise(a), noise_b = noise(b);
  if (noise_a.size() != noise_b.size()) return ::testing::AssertionFailure() << "used differ";
  for (std::size_t i = 0; i < noise_a.size(); ++i) {
    if (noise_a[i].id != noise_b[i].id)
      return ::testing::AssertionFailure() << "noise of " << noise_a[i].id << ", " << noise_b[i].id;
    const auto value = same_bits(noise_a[i].value, noise_b[i].value);
    if (!value) return value;
    const auto variance = same_bits(noise_a[i].variance, noise_b[i].variance);
    if (!variance) return variance;
  }
  return ::testing::AssertionSuccess();
}

/// Everything that a later step depends on.
template <class F>
::testing::AssertionResult same_recursion(const F& a, const F& b) {
  if (a.state().time != b.state().time) return ::testing::AssertionFailure() << "times differ";
  if (a.state().oldest != b.state().oldest) return ::testing::AssertionFailure() << "oldest differ";
  if (a.started() != b.started()) return ::testing::AssertionFailure() << "started differ";
  if (a.buffer().count() != b.buffer().count())
    return ::testing::AssertionFailure()
           << a.buffer().count() << " and " << b.buffer().count() << " are waiting";
  const auto likelihood = same_bits(a.state().likelihood.value(), b.state().likelihood.value());
  return likelihood ? same_belief(a.state().belief, b.state().belief) : likelihood;
}

/// Everything that a caller can see, but the counters.
template <class F>
::testing::AssertionResult same_state(const F& a, const F& b) {
  const auto recursion = same_recursion(a, b);
  return recursion ? same_noise(a, b) : recursion;
}

/// A filter that has made one step with two measurements, and has one waiting.
template <class F>
F under_way(F filter) {
  EXPECT_EQ(filter.push(100 * millisecond, 0, 21.0, 1), Status::ok);
  EXPECT_EQ(filter.push(150 * millisecond, 1, 22.0, 2), Status::ok);
  EXPECT_EQ(filter.push(900 * millisecond, 0, 23.0, 3), Status::ok);
  estimate(filter, 200 * millisecond);
  return filter;
}

// ── What the numbers are ───────────────────────────────────────────────────────────────────────

TEST(Filter, IsTheTextbookKalmanFilterAtTheTimesOfValidity) {
  const SpeedSystem system = speed_system();
  auto filter = streaming(system);
  Kalman expected(filter.state().belief);
  std::vector<Row> log = random_log(system, 200, 31);
  std::vector<Measurement> sorted;
  for (const Row& row : log) {
    ASSERT_EQ(filter.push(row.stamp, row.sensor, row.value, 0), Status::ok);
    const auto& s = system.sensor(row.sensor);
    sorted.push_back({row.stamp - s.latency, row.value, 0, row.sensor});
  }
  std::sort(sorted.begin(), sorted.end(), before);
  Time time = 0;
  const auto move_to = [&](Time to) {
    ChainTransition<2> transition;
    (void)system.model().transition(to - time, transition);
    expected.predict(dense(transition, 2));
    time = to;
  };
  Real sse = 0.0, log_likelihood = 0.0;
  for (const Measurement& m : sorted) {
    move_to(m.valid);
    const Real r = Real(system.sensor(m.sensor).sigma) * system.sensor(m.sensor).sigma;
    const Real innovation = m.value - expected.x(0);
    const Real S = expected.update(Eigen::Vector2d{1.0, 0.0}, r, innovation);
    sse += innovation * innovation / S;
    log_likelihood -= 0.5L * (1.8378770664093454836L + std::log(S) + innovation * innovation / S);
  }
  move_to(20 * second);
  const StepError error = estimate(filter, 20 * second);
  EXPECT_EQ(error.degrees, 200);
  EXPECT_NEAR(error.sse / double(sse), 1.0, 1e-12);
  EXPECT_NEAR(filter.state().likelihood.value() / double(log_likelihood), 1.0, 1e-12);
  EXPECT_LT(test::error(filter.state().belief.x, expected.x), 1e-12);
  EXPECT_LT(covariance_error(filter.state().belief.P, expected.P), 1e-12);
}

template <class System>
void expect_independent_of_estimation_times(const System& system) {
  const Time period = second;
  std::vector<typename System::Belief> beliefs[3];
  double log_likelihood[3];
  for (int pass = 0; pass < 3; ++pass) {
    auto filter = streaming(system);
    const std::vector<Row> log = random_log(system, 600, 32);
    std::size_t next = 0;
    for (Time time = period / (1 << pass); time <= 15 * second; time += period / (1 << pass)) {
      // by validity: what arrives after an estimate would be too late in the finer passes only
      for (; next < log.size() && log[next].stamp <= time + second; ++next)
        ASSERT_EQ(filter.push(log[next].stamp, log[next].sensor, log[next].value, 0), Status::ok);
      estimate(filter, time);
      if (time % period == 0) beliefs[pass].push_back(filter.state().belief);
    }
    log_likelihood[pass] = filter.state().likelihood.value();
  }
  ASSERT_EQ(beliefs[0].size(), 15u);
  for (int pass : {1, 2}) {
    EXPECT_NEAR(log_likelihood[pass] / log_likelihood[0], 1.0, 1e-11);
    for (std::size_t i = 0; i < beliefs[0].size(); ++i) {
      EXPECT_LT(error(beliefs[pass][i].x, beliefs[0][i].x), 1e-11);
      EXPECT_LT(covariance_error(beliefs[pass][i].P, beliefs[0][i].P), 1e-10);
    }
  }
}

TEST(Filter, DoesNotDependOnTheTimesOfTheEstimates) {
  expect_independent_of_estimation_times(speed_system());
  AnySystem linear{AnyModel(ConstantAccelerationWithPosition(0.08))};
  const Eigen::Vector3d position{1.0, 0.0, 0.0}, speed{0.0, 1.0, 0.0};
  ASSERT_EQ(linear.add(sensor<AnySystem>(speed, 0.3, 0, {}, {0.1, 10.0})), ConfigStatus::ok);
  ASSERT_EQ(linear.add(sensor<AnySystem>(position, 3.0, 100 * millisecond)), ConfigStatus::ok);
  expect_independent_of_estimation_times(linear);
}

TEST(Filter, SseIsTheSumOfTheNormalisedInnovationsSquared) {
  SpeedFilter filter = speed_filter(), one_by_one = speed_filter();
  double sum = 0.0;
  for (int i = 1; i <= 20; ++i) {
    const double value = 20.0 + std::sin(i);
    ASSERT_EQ(filter.push(i * 10 * millisecond, 0, value, i), Status::ok);
    ASSERT_EQ(one_by_one.push(i * 10 * millisecond, 0, value, i), Status::ok);
    const StepError error = estimate(one_by_one, i * 10 * millisecond);
    EXPECT_EQ(error.degrees, 1);
    sum += error.sse;
  }
  const StepError error = estimate(filter, 200 * millisecond);
  EXPECT_EQ(error.degrees, 20);
  EXPECT_NEAR(error.sse / sum, 1.0, 1e-13);
}

TEST(Filter, AStepWithoutMeasurementsOnlyPredicts) {
  SpeedFilter filter = speed_filter();
  const auto before = filter.state().belief;
  const StepError error = estimate(filter, 2 * second);
  EXPECT_EQ(error.degrees, 0);
  EXPECT_EQ(error.sse, 0.0);
  EXPECT_EQ(filter.used(), 0u);
  auto expected = before;
  ChainTransition<2> transition;
  (void)filter.system().model().transition(2 * second, transition);
  predict(expected, transition);
  EXPECT_TRUE(same_belief(filter.state().belief, expected));
}

// ── Late, early, repeated ──────────────────────────────────────────────────────────────────────

template <class System>
void expect_late_is_in_time(const System& system) {
  Random random(33);
  const std::vector<Row> log = random_log(system, 300, 34);
  auto in_time = streaming(system), late = streaming(system);
  std::size_t next = 0;
  for (Time time = 2 * second; time <= 8 * second; time += second) {
    std::vector<std::size_t> order;
    for (; next < log.size() && log[next].stamp <= time; ++next) order.push_back(next);
    const auto push = [&](auto& filter) {
      for (std::size_t i : order) {
        const Status status =
            filter.push(log[i].stamp, log[i].sensor, log[i].value, static_cast<std::int64_t>(i));
        ASSERT_TRUE(status == Status::ok || status == Status::too_late);
      }
    };
    push(in_time);
    for (std::size_t i = order.size(); i > 1; --i)
      std::swap(order[i - 1], order[static_cast<std::size_t>(random.integer(static_cast<int>(i)))]);
    push(late);
    const StepError a = estimate(in_time, time), b = estimate(late, time);
    ASSERT_EQ(a.degrees, b.degrees);
    ASSERT_TRUE(same_bits(a.sse, b.sse));
    ASSERT_TRUE(same_state(in_time, late));
  }
  EXPECT_EQ(in_time.counters().all(), late.counters().all());
}

TEST(Filter, LateWithinTheStepGivesTheBitsOfInTime) {
  expect_late_is_in_time(speed_system());
  expect_late_is_in_time(train_system());
}

TEST(Filter, TooLateIsCountedAndNotUsed) {
  SpeedFilter filter = under_way(speed_filter()), expected = filter;
  EXPECT_EQ(filter.push(200 * millisecond, 0, 99.0, 7), Status::too_late)
      << "valid at the estimate";
  EXPECT_EQ(filter.push(300 * millisecond, 2, 99.0, 7), Status::too_late) << "150 ms of latency";
  EXPECT_EQ(filter.counters()[Status::too_late], 2);
  EXPECT_TRUE(same_state(filter, expected));
  estimate(filter, second);
  estimate(expected, second);
  EXPECT_TRUE(same_state(filter, expected));
}

TEST(Filter, OneNanosecondAfterTheEstimateIsNotTooLate) {
  SpeedFilter filter = under_way(speed_filter());
  EXPECT_EQ(filter.push(200 * millisecond + 1, 0, 20.0, 7), Status::ok);
}

TEST(Filter, BeforeTheStartIsTooLate) {
  SpeedFilter filter = speed_filter();
  EXPECT_EQ(filter.push(-1, 0, 20.0, 0), Status::too_late);
  EXPECT_EQ(filter.push(149 * millisecond, 2, 20.0, 0), Status::too_late);
  EXPECT_EQ(filter.push(0, 0, 20.0, 0), Status::ok);
}

TEST(Filter, AMeasurementValidAtTheEstimateBelongsToItsStep) {
  SpeedFilter filter = speed_filter();
  ASSERT_EQ(filter.push(second, 0, 20.0, 0), Status::ok);
  ASSERT_EQ(filter.push(second + 1, 0, 20.0, 0), Status::ok);
  EXPECT_EQ(estimate(filter, second).degrees, 1);
  EXPECT_EQ(filter.buffer().count(), 1u);
}

TEST(Filter, ARepeatedMessageIsUsedOnceAndADifferentValueTwice) {
  SpeedFilter filter = speed_filter(), once = speed_filter();
  for (auto* f : {&filter, &once}) ASSERT_EQ(f->push(second, 0, 20.0, 0), Status::ok);
  EXPECT_EQ(filter.push(second, 0, 20.0, 0), Status::repeated);
  EXPECT_EQ(filter.counters()[Status::repeated], 1);
  EXPECT_TRUE(same_state(filter, once));
  EXPECT_EQ(filter.push(second, 0, 20.5, 1), Status::ok);
  EXPECT_EQ(estimate(filter, second).degrees, 2);
}

TEST(Filter, AFullBufferRefusesAndCountsUntilAnEstimateEmptiesIt) {
  Filter<SpeedSystem, 2> filter(speed_system(), broad(speed_system()), 0);
  ASSERT_EQ(filter.push(1, 0, 20.0, 0), Status::ok);
  ASSERT_EQ(filter.push(2, 0, 20.0, 1), Status::ok);
  const auto before = filter;
  EXPECT_EQ(filter.push(3, 0, 20.0, 2), Status::buffer_full);
  EXPECT_EQ(filter.counters()[Status::buffer_full], 1);
  EXPECT_TRUE(same_state(filter, before));
  estimate(filter, 2);
  EXPECT_EQ(filter.push(3, 0, 20.0, 2), Status::ok);
}

// ── What is refused leaves no trace but its count ──────────────────────────────────────────────

template <class F>
void expect_refused(F& filter, Time stamp, std::int32_t sensor, double value, Status why) {
  const F before = filter;
  EXPECT_EQ(filter.push(stamp, sensor, value, 9), why) << name(why);
  EXPECT_EQ(filter.counters()[why], before.counters()[why] + 1);
  EXPECT_TRUE(same_state(filter, before));
}

TEST(Filter, RefusesValuesThatAreNotNumbers) {
  SpeedFilter filter = under_way(speed_filter());
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (double value : {std::nan(""), infinity, -infinity})
    expect_refused(filter, second, 0, value, Status::not_finite);
}

TEST(Filter, RefusesSensorsThatItDoesNotKnow) {
  SpeedFilter filter = under_way(speed_filter());
  for (std::int32_t sensor : {-1, 3, 1000, std::numeric_limits<std::int32_t>::min()})
    expect_refused(filter, second, sensor, 20.0, Status::unknown_sensor);
}

TEST(Filter, RefusesStampsBeyond95Years) {
  SpeedFilter filter = under_way(speed_filter());
  const Time last = static_cast<Time>(max_seconds * 1e9);
  expect_refused(filter, last + 1, 0, 20.0, Status::not_finite);
  expect_refused(filter, std::numeric_limits<Time>::max(), 0, 20.0, Status::not_finite);
  expect_refused(filter, std::numeric_limits<Time>::min(), 0, 20.0, Status::not_finite);
  EXPECT_EQ(filter.push(last, 0, 20.0, 9), Status::ok);
}

TEST(Filter, AnEstimateBeyond95YearsIsNotFinite) {
  SpeedFilter filter = under_way(speed_filter()), before = filter;
  StepError error;
  for (Time time : {std::numeric_limits<Time>::max(), std::numeric_limits<Time>::min()}) {
    EXPECT_EQ(filter.estimate(time, error), Status::not_finite);
    EXPECT_TRUE(same_state(filter, before));
  }
  EXPECT_EQ(filter.counters()[Status::not_finite], 2);
}

TEST(Filter, AnEstimateBeforeTheLastOneIsTimeBackwards) {
  SpeedFilter filter = under_way(speed_filter()), before = filter;
  StepError error{42.0, 42};
  EXPECT_EQ(filter.estimate(200 * millisecond - 1, error), Status::time_backwards);
  EXPECT_EQ(filter.counters()[Status::time_backwards], 1);
  EXPECT_EQ(error.degrees, 42) << "nothing was given";
  EXPECT_TRUE(same_state(filter, before));
}

TEST(Filter, AnEstimateAtTheTimeOfTheLastOneIsTheSameBelief) {
  SpeedFilter filter = under_way(speed_filter());
  const auto before = filter.state().belief;
  EXPECT_EQ(estimate(filter, 200 * millisecond).degrees, 0);
  EXPECT_TRUE(same_belief(filter.state().belief, before));
}

AnySystem unstable_system() {
  const Eigen::Matrix2d A{{0.01, 0.0}, {0.0, -1.0}}, W = Eigen::Matrix2d::Identity();
  AnySystem system{AnyModel(AnyModel::Linear(A, W))};
  const Eigen::Vector2d h{1.0, 1.0};
  (void)system.add(sensor<AnySystem>(h, 1.0));
  (void)system.add(sensor<AnySystem>(h, 1.0));
  return system;
}

AnySystem gridded_system() {
  const Eigen::Matrix2d F{{0.9, 0.1}, {0.0, 0.9}}, Q = Eigen::Matrix2d::Identity();
  AnySystem system{AnyModel(AnyModel::Discrete(F, Q, 50 * millisecond))};
  const Eigen::Vector2d h{1.0, 1.0};
  (void)system.add(sensor<AnySystem>(h, 1.0));
  (void)system.add(sensor<AnySystem>(h, 1.0));
  return system;
}

/// An estimate that cannot be made with measurements ready before it. The noise of the last step
/// may be gone afterwards, but is never mixed with that of the step that was not made.
void expect_failed_estimate_changes_nothing(const AnySystem& system, Time impossible, Status why) {
  AnyStreaming filter = under_way(streaming(system)), before = filter;
  StepError error{42.0, 42};
  EXPECT_EQ(filter.estimate(impossible, error), why);
  EXPECT_EQ(filter.counters()[why], 1);
  EXPECT_EQ(filter.counters()[Status::ok], 3) << "what waits is still ok";
  EXPECT_EQ(error.degrees, 42) << "nothing was given";
  EXPECT_TRUE(same_recursion(filter, before));
  EXPECT_TRUE(filter.used() == 0 || same_noise(filter, before));
  EXPECT_EQ(estimate(filter, second).degrees, 1) << "the measurement still waits";
  EXPECT_EQ(estimate(before, second).degrees, 1);
  EXPECT_TRUE(same_state(filter, before));
}

TEST(Filter, AnEstimateOffTheGridChangesNothing) {
  expect_failed_estimate_changes_nothing(gridded_system(), 975 * millisecond, Status::off_grid);
}

TEST(Filter, AnEstimateThatOverflowsChangesNothing) {
  expect_failed_estimate_changes_nothing(unstable_system(), year, Status::numerical);
}

TEST(Filter, AMeasurementAndAnEstimateThatBothFailLeaveNoTraceInTheNoise) {
  AnyStreaming filter = streaming(unstable_system());
  ASSERT_EQ(filter.push(100 * millisecond, 0, 21.0, 1), Status::ok);
  estimate(filter, 200 * millisecond);
  const AnyStreaming before = filter;
  ASSERT_EQ(filter.push(900 * millisecond, 0, 1.7e308, 2), Status::ok);  // ν²/S is infinite
  StepError error;
  EXPECT_EQ(filter.estimate(year, error), Status::numerical);
  EXPECT_EQ(filter.counters()[Status::numerical], 1) << "the estimate; the measurement waits";
  EXPECT_EQ(filter.counters()[Status::ok], 2);
  EXPECT_TRUE(same_belief(filter.state().belief, before.state().belief));
  EXPECT_TRUE(filter.used() == 0 || same_noise(filter, before));
}

TEST(Filter, AMeasurementOffTheGridIsCountedAndNotUsed) {
  AnyStreaming filter = under_way(streaming(gridded_system())), expected = filter;
  ASSERT_EQ(filter.push(625 * millisecond, 0, 99.0, 9), Status::ok);
  EXPECT_EQ(estimate(filter, second).degrees, 1);
  estimate(expected, second);
  EXPECT_EQ(filter.counters()[Status::off_grid], 1);
  EXPECT_EQ(filter.counters()[Status::ok], 3) << "counted once, as what became of it";
  EXPECT_TRUE(same_state(filter, expected));
}

TEST(Filter, AMeasurementThatOverflowsIsCountedAndNotUsed) {
  const SpeedSystem system = speed_system();
  auto fast = broad(system);
  fast.x(0) = -1e308;
  SpeedFilter filter(system, fast, 0), expected = filter;
  for (auto* f : {&filter, &expected}) ASSERT_EQ(f->push(second / 2, 0, -1e308, 1), Status::ok);
  ASSERT_EQ(filter.push(second, 0, 1.7e308, 2), Status::ok);  // ν = z − ẑ is infinite
  EXPECT_EQ(estimate(filter, second).degrees, 1);
  EXPECT_EQ(estimate(expected, second).degrees, 1);
  EXPECT_EQ(filter.counters()[Status::numerical], 1);
  EXPECT_EQ(filter.counters()[Status::ok], 1);
  EXPECT_TRUE(same_state(filter, expected));
}

TEST(Filter, APredictionThatOverflowsIsRefusedAndItsMeasurementsCounted) {
  Filter<SpeedSystem, 64> filter(speed_system(), broad(speed_system(), 20.0, 1e300), 0);
  const Time far = 1'000'000 * second;  // 1e300 · 1e12
  StepError error;
  EXPECT_EQ(filter.estimate(far, error), Status::numerical);
  ASSERT_EQ(filter.push(far, 0, 20.0, 0), Status::ok);
  EXPECT_EQ(filter.estimate(far, error), Status::numerical);
  EXPECT_EQ(filter.state().time, 0);
  EXPECT_EQ(filter.state().belief.P(0, 0), 1e300);
}

TEST(Filter, AYearsGapIsAnsweredWithAFiniteBelief) {
  SpeedFilter filter = under_way(speed_filter());
  ASSERT_EQ(filter.push(year, 0, 30.0, 4), Status::ok);
  EXPECT_EQ(estimate(filter, year).degrees, 2);
  const auto& belief = filter.state().belief;
  EXPECT_TRUE(belief.x.allFinite() && belief.P.allFinite());
  EXPECT_NEAR(belief.x(0), 30.0, 1e-3);
  EXPECT_NEAR(belief.P(0, 0), 1.0, 1e-3);
}

// ── Start, save and restore ────────────────────────────────────────────────────────────────────

TEST(Filter, WithoutAStartItStartsAtTheEarliestMeasurement) {
  const SpeedSystem system = speed_system();
  SpeedFilter filter(system, broad(system)), expected(system, broad(system), 5 * second);
  EXPECT_FALSE(filter.started());
  for (auto* f : {&filter, &expected}) {
    ASSERT_EQ(f->push(6 * second, 1, 20.0, 1), Status::ok);
    ASSERT_EQ(f->push(5 * second, 0, 20.0, 0), Status::ok);
    EXPECT_EQ(estimate(*f, 7 * second).degrees, 2);
  }
  EXPECT_TRUE(filter.started());
  EXPECT_TRUE(same_state(filter, expected));
}

TEST(Filter, WithoutAStartAndMeasurementsItStartsAtTheFirstEstimate) {
  const SpeedSystem system = speed_system();
  SpeedFilter filter(system, broad(system)), expected(system, broad(system), 7 * second);
  EXPECT_EQ(estimate(filter, 7 * second).degrees, 0);
  estimate(expected, 7 * second);
  EXPECT_TRUE(same_state(filter, expected));
  EXPECT_TRUE(same_belief(filter.state().belief, broad(system)));
}

TEST(Filter, WithoutAStartTimesBefore1970AreFine) {
  const SpeedSystem system = speed_system();
  SpeedFilter filter(system, broad(system));
  ASSERT_EQ(filter.push(-5 * second, 0, 20.0, 0), Status::ok);
  EXPECT_EQ(estimate(filter, -4 * second).degrees, 1);
}

TEST(Filter, ContinuesFromWhatWasSavedWithTheSameBits) {
  SpeedFilter filter = under_way(speed_filter()), other = speed_filter();
  std::vector<Measurement> waiting;
  for (std::size_t i = 0; i < filter.buffer().count(); ++i) waiting.push_back(filter.buffer()[i]);
  ASSERT_EQ(other.restore(filter.state(), filter.started(), filter.counters(), waiting.data(),
                          waiting.size()),
            Status::ok);
  for (auto* f : {&filter, &other}) {
    ASSERT_EQ(f->push(1100 * millisecond, 1, 24.0, 5), Status::ok);
    estimate(*f, 2 * second);
  }
  EXPECT_TRUE(same_state(filter, other));
  EXPECT_EQ(filter.counters().all(), other.counters().all());
}

TEST(Filter, RestoreRefusesMoreThanItHasRoomFor) {
  Filter<SpeedSystem, 2> filter(speed_system(), broad(speed_system()), 0);
  const auto before = filter;
  const std::vector<Measurement> waiting{{1, 1.0, 0, 0}, {2, 1.0, 0, 0}, {3, 1.0, 0, 0}};
  const SpeedFilter other = under_way(speed_filter());
  EXPECT_EQ(filter.restore(other.state(), true, other.counters(), waiting.data(), waiting.size()),
            Status::buffer_full);
  EXPECT_TRUE(same_state(filter, before));
}

/// `waiting` and what `change` makes of a good state must be refused.
template <class Change>
void expect_not_restored(const Measurement& waiting, Status why, Change&& change) {
  SpeedFilter filter = under_way(speed_filter());
  const SpeedFilter before = filter;
  auto state = filter.state();
  change(state);
  EXPECT_EQ(filter.restore(state, true, Counters(), &waiting, 1), why) << name(why);
  EXPECT_TRUE(same_state(filter, before));
  EXPECT_EQ(filter.counters().all(), before.counters().all());
}

TEST(Filter, RestoreRefusesMeasurementsThatItWouldNotHaveTaken) {
  const auto as_it_is = [](auto&) {};
  constexpr Time far = std::numeric_limits<Time>::max(), none = std::numeric_limits<Time>::min();
  const Time at = 200 * millisecond;  // the last estimate
  expect_not_restored({at, 20.0, 1, 0}, Status::too_late, as_it_is);
  expect_not_restored({-at, 20.0, 1, 0}, Status::too_late, as_it_is);
  expect_not_restored({max_time + 1, 20.0, 1, 0}, Status::not_finite, as_it_is);
  expect_not_restored({far, 20.0, 1, 2}, Status::not_finite, as_it_is);
  expect_not_restored({none, 20.0, 1, 2}, Status::not_finite, as_it_is);
  expect_not_restored({second, std::nan(""), 1, 0}, Status::not_finite, as_it_is);
  for (const double factor : {0.0, 1e-7, 1e7, std::nan("")})
    expect_not_restored({second, 20.0, 1, 0, factor}, Status::not_finite, as_it_is);
  expect_not_restored({second, 20.0, 1, 3}, Status::unknown_sensor, as_it_is);
  expect_not_restored({second, 20.0, 1, -1}, Status::unknown_sensor, as_it_is);
}

TEST(Filter, RestoreRefusesTimesThatNoFilterHas) {
  const Measurement good{second, 20.0, 1, 0};
  for (Time far :
       {max_time + 1, std::numeric_limits<Time>::max(), std::numeric_limits<Time>::min()})
    expect_not_restored(good, Status::not_finite, [&](auto& state) { state.time = far; });
  expect_not_restored(good, Status::time_backwards,
                      [](auto& state) { state.oldest = state.time - 1; });
}

TEST(Filter, RestoreTakesWhatWaitsBeforeTheStartIsKnown) {
  const SpeedSystem system = speed_system();
  SpeedFilter filter(system, broad(system)), other = filter;
  const Measurement waiting{-5 * second, 20.0, 1, 0};
  ASSERT_EQ(other.restore(filter.state(), false, filter.counters(), &waiting, 1), Status::ok);
  EXPECT_EQ(estimate(other, -4 * second).degrees, 1);
}

TEST(Filter, RestoreTakesEverythingThatPushTakes) {
  SpeedSystem system{ConstantAcceleration(0.08)};
  for (Time latency : {-1000 * second, 1000 * second}) {
    const auto early = sensor<SpeedSystem>(Eigen::Vector2d{1.0, 0.0}, 1.0, latency);
    ASSERT_EQ(system.add(early), ConfigStatus::ok);
  }
  SpeedFilter filter(system, broad(system)), other = filter;
  ASSERT_EQ(filter.push(max_time, 0, 20.0, 0), Status::ok);
  ASSERT_EQ(filter.push(-max_time, 1, 20.0, 0), Status::ok);
  const std::vector<Measurement> waiting{filter.buffer()[0], filter.buffer()[1]};
  EXPECT_EQ(other.restore(filter.state(), false, filter.counters(), waiting.data(), 2), Status::ok);
  EXPECT_TRUE(same_state(filter, other));
}

TEST(Filter, RestoreCountsAMessageThatWaitsTwice) {
  SpeedFilter filter = under_way(speed_filter());
  const std::vector<Measurement> waiting(2, {second, 20.0, 1, 0});
  Counters counters;
  counters.count(Status::ok);
  counters.count(Status::ok);
  ASSERT_EQ(filter.restore(filter.state(), true, counters, waiting.data(), 2), Status::ok);
  EXPECT_EQ(filter.buffer().count(), 1u);
  EXPECT_EQ(filter.counters()[Status::ok], 1);
  EXPECT_EQ(filter.counters()[Status::repeated], 1);
}

TEST(Filter, RunsTwiceWithTheSameBits) {
  const SpeedFilter a = under_way(speed_filter()), b = under_way(speed_filter());
  EXPECT_TRUE(same_state(a, b));
}

}  // namespace
}  // namespace surefix::desync
