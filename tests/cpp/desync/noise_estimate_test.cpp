// The backward sweep against Γ of the whole log, formed and inverted.
#include "surefix/desync/noise_estimate.hpp"

#include <gtest/gtest.h>

#include "columns.hpp"
#include "composite_reference.hpp"
#include "surefix/desync/batch.hpp"
#include "surefix/desync/filter.hpp"

namespace surefix::desync {
namespace {

using namespace test;

/// A linear system: five states, plain and biased sensors, no scale.
AnySystem linear_system() {
  AnySystem system{AnyModel(ConstantAccelerationWithPosition(0.5))};
  const Eigen::Vector3d position{1.0, 0.0, 0.0}, speed{0.0, 1.0, 0.0};
  (void)system.add(sensor<AnySystem>(speed, 0.3, 0, {}, {0.5, 2.0}));
  (void)system.add(sensor<AnySystem>(speed, 0.6, 30 * millisecond));
  (void)system.add(sensor<AnySystem>(position, 2.0, 0, {}, {3.0}));
  return system;
}

/// The sorted measurements as one composite step from `start` to `end`.
template <class System>
StepCase as_step(const System& system, const typename System::Belief& belief,
                 const std::vector<Measurement>& sorted, Time start, Time end) {
  const int n = system.state_size();
  StepCase out;
  out.x = belief.x;
  out.P = belief.P;
  out.z.resize(static_cast<Eigen::Index>(sorted.size()));
  out.u.resize(0);
  out.Upsilon = Eigen::MatrixXd::Zero(out.z.size(), out.z.size());
  Time time = start;
  const auto add_leg = [&](Time to) {
    typename System::Transition transition;
    EXPECT_EQ(system.transition(to - time, transition), Status::ok);
    const FQ fq = dense(transition, n);
    out.legs.push_back({fq.F, fq.Q, Eigen::MatrixXd(n, 0)});
    time = to;
  };
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const Measurement& m = sorted[i];
    add_leg(m.valid);
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(1, n);
    auto unused = belief;
    const Linearisation at = system.read(m.sensor, belief.x).at;
    h = system.with_row(m.sensor, at, unused, [&](const auto& row, auto&) {
      row.for_each([&](int j, double coefficient) { h(0, j) = coefficient; });
      return h;
    });
    const double sigma = system.sensor(m.sensor).sigma;
    const auto k = static_cast<Eigen::Index>(i);
    out.observations.push_back(
        {h, Eigen::MatrixXd::Constant(1, 1, sigma * sigma), Eigen::MatrixXd(1, 0)});
    out.Upsilon(k, k) = sigma * sigma;
    out.z(k) = m.value;
  }
  add_leg(end);
  return out;
}

template <class System>
void expect_journey(const System& system, std::uint64_t seed) {
  const std::vector<Row> log = random_log(system, 80, seed);
  const std::vector<Time> times{1500 * millisecond, 2 * second, 5 * second};
  Columns columns(system, log, times.size());
  const SortedLog log_sorted(system, columns.view(), columns.status.data());
  std::vector<Measurement> sorted;
  for (std::size_t i = 0; i < log_sorted.size(); ++i) sorted.push_back(log_sorted[i]);
  const auto initial = broad(system);
  const Time start = sorted.front().valid - 10 * millisecond;
  auto state = start_state(initial, start);
  std::size_t made = 0;
  ASSERT_EQ(run_batch(system, state, log_sorted, {times.data(), times.size(), NoiseScope::journey},
                      columns.output(), made),
            Status::ok);
  const StepReference expected = brute_force(as_step(system, initial, sorted, start, times.back()));
  EXPECT_LT(error(state.belief.x, expected.x), 1e-10);
  EXPECT_LT(error(state.belief.P, expected.P), 1e-10);
  double sse = 0.0;
  for (double step : columns.sse) sse += step;
  EXPECT_NEAR(sse / double(expected.sse), 1.0, 1e-11);
  EXPECT_NEAR(state.likelihood.value() / double(expected.log_likelihood), 1.0, 1e-11);
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const auto row = static_cast<std::size_t>(sorted[i].id);
    const auto at = static_cast<Eigen::Index>(i);
    const double variance = static_cast<double>(expected.noise_variance(at));
    EXPECT_NEAR(columns.noise[row], double(expected.noise(at)), 1e-9 * std::sqrt(variance));
    EXPECT_NEAR(columns.noise_variance[row] / variance, 1.0, 1e-9);
  }
}

TEST(NoiseEstimate, OfAJourneyIsUpsilonGammaInverseInnovation) {
  for (std::uint64_t seed : {91, 92}) {
    expect_journey(speed_system(), seed);
    expect_journey(linear_system(), seed);
  }
}

TEST(NoiseEstimate, OfAStepIsThatOfItsCompositeStep) {
  const SpeedSystem system = speed_system();
  const std::vector<Row> log = random_log(system, 150, 93);
  Filter<SpeedSystem, -1> filter(system, broad(system), 0);
  filter.reserve(log.size());
  for (std::size_t i = 0; i < log.size(); ++i)
    ASSERT_EQ(filter.push(log[i].stamp, log[i].sensor, log[i].value, static_cast<std::int64_t>(i)),
              Status::ok);
  int compared = 0;
  for (Time time = second; time < 6 * second; time += 200 * millisecond) {
    std::vector<Measurement> sorted;
    for (std::size_t i = 0; i < filter.buffer().ready(time); ++i)
      sorted.push_back(filter.buffer()[i]);
    const auto before = filter.state();
    StepError step_error;
    ASSERT_EQ(filter.estimate(time, step_error), Status::ok);
    ASSERT_EQ(filter.used(), sorted.size());
    if (sorted.empty()) continue;
    const StepReference expected =
        brute_force(as_step(system, before.belief, sorted, before.time, time));
    EXPECT_NEAR(step_error.sse / double(expected.sse), 1.0, 1e-11);
    filter.noise([&](std::size_t i, const NoiseEstimate& e) {
      const auto at = static_cast<Eigen::Index>(i);
      EXPECT_EQ(e.id, sorted[i].id);
      EXPECT_NEAR(e.value, double(expected.noise(at)), 1e-11);
      EXPECT_NEAR(e.variance, double(expected.noise_variance(at)), 1e-11);
      ++compared;
    });
  }
  EXPECT_GT(compared, 100);
}

TEST(NoiseEstimate, NormalisedIsOfUnitVarianceWhenNothingIsWrong) {
  const SpeedSystem system = speed_system();
  Random random(94);
  Filter<SpeedSystem, 64> filter(system, broad(system, 0.0, 1.0), 0);
  Eigen::Vector2d truth{random.normal(), random.normal()};
  double sum = 0.0, squares = 0.0;
  int count = 0;
  const double dt = 0.02, q = 0.08;
  for (int k = 1; k <= 20000; ++k) {
    const double a = q * std::sqrt(dt) * random.normal();
    const double b = q * std::sqrt(dt * dt * dt / 12.0) * random.normal();
    truth(0) += dt * truth(1) + 0.5 * dt * a + b;
    truth(1) += a;
    const int s = k % 2;
    const Time now = k * 20 * millisecond;
    ASSERT_EQ(filter.push(now + system.sensor(s).latency, s,
                          truth(0) + system.sensor(s).sigma * random.normal(), k),
              Status::ok);
    if (k % 40 != 0) continue;
    StepError step_error;
    ASSERT_EQ(filter.estimate(now, step_error), Status::ok);
    filter.noise([&](std::size_t, const NoiseEstimate& e) {
      const double normalised = e.value / std::sqrt(e.variance);
      sum += normalised;
      squares += normalised * normalised;
      ++count;
    });
  }
  EXPECT_EQ(count, 20000);
  EXPECT_NEAR(sum / count, 0.0, 0.05);
  EXPECT_NEAR(squares / count, 1.0, 0.05);
}

}  // namespace
}  // namespace surefix::desync
