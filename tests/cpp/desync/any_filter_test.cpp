#include "surefix/desync/any_filter.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "columns.hpp"
#include "dense.hpp"

namespace surefix::desync {
namespace {

using namespace test;

AnySystem::ModelBelief model_belief(const AnySystem& system) {
  const int n = system.model_size();
  return {Eigen::VectorXd::Constant(n, 20.0), 100.0 * Eigen::MatrixXd::Identity(n, n)};
}

std::unique_ptr<AnyFilter> make(const AnySystem& system, std::optional<Time> start = 0,
                                std::size_t capacity = 1000) {
  return AnyFilter::make(system, model_belief(system), start, capacity);
}

/// Pushes a log and estimates every second; returns the beliefs.
template <class F, class BeliefOf>
std::vector<AnySystem::Belief> run(F& filter, const std::vector<Row>& log, Time from, Time to,
                                   BeliefOf&& belief) {
  std::vector<AnySystem::Belief> out;
  for (std::size_t i = 0; i < log.size(); ++i)
    (void)filter.push(log[i].stamp, log[i].sensor, log[i].value, static_cast<std::int64_t>(i));
  for (Time time = from; time <= to; time += second) {
    StepError error;
    EXPECT_EQ(filter.estimate(time, error), Status::ok);
    out.push_back(belief(filter));
  }
  return out;
}

const auto belief_of_any = [](const AnyFilter& filter) { return filter.belief(); };

TEST(AnyFilter, TheSpeedPathAgreesWithTheGeneralPath) {
  const AnySystem system = any_speed_system();
  const std::vector<Row> log = random_log(system, 500, 51);
  const auto fast = make(system);
  Filter<AnySystem, -1> general(system, broad(system), 0);
  general.reserve(log.size());
  const auto a = run(*fast, log, second, 12 * second, belief_of_any);
  const auto b = run(general, log, second, 12 * second,
                     [](const auto& filter) { return filter.state().belief; });
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_LT(error(a[i].x, b[i].x), 1e-12);
    EXPECT_LT(covariance_error(a[i].P, b[i].P), 1e-12);
  }
  EXPECT_NEAR(fast->log_likelihood() / general.state().likelihood.value(), 1.0, 1e-12);
  const std::vector<NoiseEstimate> noise = fast->noise();
  ASSERT_EQ(noise.size(), general.used());
  general.noise([&](std::size_t i, const NoiseEstimate& e) {
    EXPECT_EQ(noise[i].id, e.id);
    EXPECT_NEAR(noise[i].value, e.value, 1e-12);
    EXPECT_NEAR(noise[i].variance, e.variance, 1e-12);
  });
}

TEST(AnyFilter, TheSpeedPathHasTheBitsOfTheFixedSizeFilter) {
  const std::vector<Row> log = random_log(speed_system(), 300, 52);
  const auto any = make(any_speed_system());
  Filter<SpeedSystem, -1> fixed(speed_system(), broad(speed_system()), 0);
  fixed.reserve(log.size());
  const auto a = run(*any, log, second, 8 * second, belief_of_any);
  const auto b = run(fixed, log, second, 8 * second, [](const auto& filter) {
    return AnySystem::Belief{filter.state().belief.x, filter.state().belief.P};
  });
  for (std::size_t i = 0; i < b.size(); ++i) {
    EXPECT_TRUE(same_bits(a[i].x, b[i].x));
    EXPECT_TRUE(same_bits(a[i].P, b[i].P));
  }
  EXPECT_TRUE(same_bits(any->log_likelihood(), fixed.state().likelihood.value()));
}

void expect_saved(const AnySystem& system) {
  const std::vector<Row> log = random_log(system, 400, 53);
  const auto filter = make(system), other = make(system);
  run(*filter, log, second, 4 * second, belief_of_any);
  ASSERT_GT(filter->waiting(), 0u);
  ASSERT_EQ(other->restore(filter->save()), Status::ok);
  EXPECT_EQ(other->waiting(), filter->waiting());
  const auto a = run(*filter, {}, 5 * second, 13 * second, belief_of_any);
  const auto b = run(*other, {}, 5 * second, 13 * second, belief_of_any);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(same_belief(a[i], b[i]));
  EXPECT_TRUE(same_bits(filter->log_likelihood(), other->log_likelihood()));
  EXPECT_EQ(filter->counters().all(), other->counters().all());
}

TEST(AnyFilter, ContinuesFromWhatWasSavedWithTheSameBits) {
  expect_saved(any_speed_system());
  expect_saved(train_system());
}

TEST(AnyFilter, RestoreRefusesWhatItCannotContinueFrom) {
  for (const AnySystem& system : {any_speed_system(), train_system()}) {
    const auto filter = make(system);
    run(*filter, random_log(system, 100, 56), second, 2 * second, belief_of_any);
    SavedFilter saved = filter->save();
    ASSERT_FALSE(saved.waiting.empty());
    saved.waiting[0].valid = saved.oldest - 1;
    EXPECT_EQ(filter->restore(saved), Status::too_late);
    saved = filter->save();
    saved.time = std::numeric_limits<Time>::min();
    EXPECT_EQ(filter->restore(saved), Status::not_finite);
    const SavedFilter after = filter->save();
    EXPECT_EQ(after.time, 2 * second);
    EXPECT_GT(after.waiting[0].valid, after.time);
  }
}

TEST(AnyFilter, BatchHasTheBitsOfStreamingAndLeavesTheFilterAlone) {
  for (const AnySystem& system : {any_speed_system(), train_system()}) {
    const std::vector<Row> log = random_log(system, 300, 54);
    const std::vector<Time> times{second, 2 * second, 3 * second, 4 * second, 5 * second};
    const auto filter = make(system);
    Columns columns(system, log, times.size());
    const PreparedLog prepared = filter->prepare(columns.view(), columns.status.data());
    const BatchSummary summary =
        filter->run(prepared, {times.data(), times.size(), NoiseScope::step}, columns.output());
    ASSERT_EQ(summary.status, Status::ok);
    ASSERT_EQ(summary.estimates, times.size());
    EXPECT_EQ(filter->counters().all(), Counters().all());
    EXPECT_EQ(filter->waiting(), 0u);
    const auto beliefs = run(*filter, log, second, 5 * second, belief_of_any);
    for (std::size_t t = 0; t < times.size(); ++t) {
      EXPECT_TRUE(same_bits(columns.mean(t), beliefs[t].x));
      EXPECT_TRUE(same_bits(columns.covariance(t), beliefs[t].P));
    }
    EXPECT_TRUE(same_bits(summary.log_likelihood, filter->log_likelihood()));
  }
}

TEST(AnyFilter, WithoutAStartBatchAndStreamingStartAtTheEarliestMeasurement) {
  const AnySystem system = any_speed_system();
  const auto filter = make(system, std::nullopt);
  const std::vector<Row> log{{6 * second, 0, 20.0}, {5 * second, 0, 21.0}, {5 * second, 1, 22.0}};
  Columns columns(system, log, 3);
  const PreparedLog prepared = filter->prepare(columns.view(), columns.status.data());
  EXPECT_EQ(prepared.start, 5 * second - 30 * millisecond);
  EXPECT_EQ(prepared.distinct, 3u);
  const Time end = 6 * second;
  const BatchSummary summary = filter->run(prepared, {&end, 1, NoiseScope::none}, columns.output());
  EXPECT_EQ(summary.estimates, 1u);
  const auto beliefs = run(*filter, log, end, end, belief_of_any);
  EXPECT_TRUE(same_bits(columns.mean(0), beliefs[0].x));
  EXPECT_EQ(columns.degrees[0], 3);
}

TEST(AnyFilter, ABatchWithoutTimesMakesNoEstimateAndAllItsRowsWait) {
  const AnySystem system = any_speed_system();
  const auto filter = make(system, std::nullopt);
  Columns columns(system, {{6 * second, 0, 20.0}, {5 * second, 1, 22.0}}, 1);
  const PreparedLog prepared = filter->prepare(columns.view(), columns.status.data());
  const Time unread = 0;
  const BatchSummary summary =
      filter->run(prepared, {&unread, 0, NoiseScope::none}, columns.output());
  EXPECT_EQ(summary.status, Status::ok);
  EXPECT_EQ(summary.estimates, 0u);
  EXPECT_EQ(columns.status, std::vector<Status>(2, Status::waiting));
}

TEST(AnyFilter, KeepsItsBeliefAndWhatWaitsWhenASensorComes) {
  const AnySystem old = any_speed_system();
  AnySystem larger = old;
  const Eigen::Vector2d speed{1.0, 0.0};
  ASSERT_EQ(larger.add(sensor<AnySystem>(speed, 0.3, 0, {}, {0.5})), ConfigStatus::ok);
  const auto filter = make(old);
  run(*filter, random_log(old, 300, 55), second, 3 * second, belief_of_any);
  const auto next = filter->with_system(larger, {0, 1, 2, -1});
  EXPECT_EQ(next->waiting(), filter->waiting());
  EXPECT_EQ(next->counters().all(), filter->counters().all());
  EXPECT_TRUE(same_bits(next->log_likelihood(), filter->log_likelihood()));
  const auto before = filter->belief(), after = next->belief();
  ASSERT_EQ(after.size(), 3);
  EXPECT_TRUE(same_bits(after.x.head(2), before.x));
  EXPECT_TRUE(same_bits(after.P.topLeftCorner(2, 2), before.P));
  EXPECT_EQ(after.P(2, 2), 0.25);

  const auto a = run(*filter, {}, 4 * second, 4 * second, belief_of_any);
  const auto b = run(*next, {}, 4 * second, 4 * second, belief_of_any);
  EXPECT_LT(error(b[0].x.head(2), a[0].x), 1e-12) << "the silent newcomer changes nothing";
}

TEST(AnyFilter, DropsWhatWaitsFromASensorThatGoes) {
  const AnySystem old = train_system();
  AnySystem smaller{old.model()};
  ASSERT_EQ(smaller.add(old.sensor(2)), ConfigStatus::ok);
  ASSERT_EQ(smaller.add(old.sensor(1)), ConfigStatus::ok);
  const auto filter = make(old);
  for (int s : {0, 1, 2}) ASSERT_EQ(filter->push(second, s, 20.0, s), Status::ok);
  const auto next = filter->with_system(smaller, {2, 1});
  EXPECT_EQ(next->waiting(), 2u);
  EXPECT_EQ(next->counters()[Status::ok], 2);
  EXPECT_EQ(next->counters()[Status::unknown_sensor], 1) << "dropped, but not in silence";
  StepError error;
  ASSERT_EQ(next->estimate(second, error), Status::ok);
  EXPECT_EQ(error.degrees, 2);
  const auto noise = next->noise();
  ASSERT_EQ(noise.size(), 2u);
  EXPECT_EQ(noise[0].id, 2) << "valid 150 ms before its stamp";
  EXPECT_EQ(noise[1].id, 1);
}

TEST(AnyFilter, AnswersAsTheFilterDoes) {
  const auto filter = make(train_system(), 0, 2);
  StepError error;
  EXPECT_EQ(filter->push(second, 9, 20.0, 0), Status::unknown_sensor);
  EXPECT_EQ(filter->push(second, 0, std::nan(""), 0), Status::not_finite);
  EXPECT_EQ(filter->push(-1, 0, 20.0, 0), Status::too_late);
  EXPECT_EQ(filter->push(second, 0, 20.0, 0), Status::ok);
  EXPECT_EQ(filter->push(second, 0, 20.0, 0), Status::repeated);
  EXPECT_EQ(filter->push(second, 1, 20.0, 0), Status::ok);
  EXPECT_EQ(filter->push(second, 2, 20.0, 0), Status::buffer_full);
  EXPECT_EQ(filter->estimate(-1, error), Status::time_backwards);
  EXPECT_EQ(filter->estimate(second, error), Status::ok);
  for (Status status : {Status::unknown_sensor, Status::not_finite, Status::too_late,
                        Status::repeated, Status::buffer_full, Status::time_backwards})
    EXPECT_EQ(filter->counters()[status], 1) << name(status);
}

}  // namespace
}  // namespace surefix::desync
