#include "surefix/drift/sliding_detector.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "surefix/core/distributions.hpp"
#include "surefix/drift/any_record.hpp"
#include "systems.hpp"

namespace surefix::drift {
namespace {

using namespace test;
using Detector = SlidingDetector<SpeedSystem, 32>;
using Filter = desync::Filter<SpeedSystem, 64>;

Profile ramp() {
  Profile out;
  Profile::Matrix A(2, 2), onset(2, 1);
  A << 0, 1, 0, 0;
  onset << 0, 1;
  EXPECT_EQ(Profile::make(A, Eigen::Vector2d(1, 0), onset, out), ConfigStatus::ok);
  return out;
}

Detector::Direction only(std::size_t sensor) {
  Detector::Direction out{};
  out[sensor] = 1.0;
  return out;
}

TEST(SlidingDetector, FindsInItsWindowWhatTheOfflineDetectorFindsThere) {
  const SpeedSystem system = speed_system();
  const auto log = random_log(system, 90, 3);
  Filter filter(system, broad(system), 0);
  Detector detector(system);
  ASSERT_EQ(detector.add(ramp(), only(0), 1e-3), ConfigStatus::ok);
  ASSERT_EQ(detector.add(ramp(), only(2), 1e-3), ConfigStatus::ok);
  desync::StepError error;
  // One measurement at a time, in order of validity, and the belief before each.
  auto sorted = log;
  std::sort(sorted.begin(), sorted.end(), [&](const Row& a, const Row& b) {
    return a.stamp - system.sensor(a.sensor).latency < b.stamp - system.sensor(b.sensor).latency;
  });
  std::vector<Filter::State> before;
  for (const Row& row : sorted) {
    before.push_back(filter.state());
    ASSERT_EQ(filter.push(row.stamp, row.sensor, row.value, 0), Status::ok);
    ASSERT_EQ(filter.estimate(row.stamp - system.sensor(row.sensor).latency, error), Status::ok);
    detector.take(filter);
  }
  ASSERT_EQ(detector.record().size(), 32u);
  // The last 32 alone, from the belief that the filter had before them.
  const std::size_t first = sorted.size() - 32;
  ForwardRecord<2> record(2, system.sensor_count(), 32);
  std::vector<Time> stamp;
  std::vector<std::int32_t> sensor;
  std::vector<double> value;
  for (std::size_t i = first; i < sorted.size(); ++i) {
    stamp.push_back(sorted[i].stamp);
    sensor.push_back(sorted[i].sensor);
    value.push_back(sorted[i].value);
  }
  std::vector<Status> status(32);
  const desync::LogView view{stamp.data(), sensor.data(), value.data(), 32};
  const desync::SortedLog window(system, view, status.data());
  LargeArray<double> innovations(32);
  double likelihood = 0.0;
  pass_log(system, before[first].belief, before[first].time, window, status.data(), record,
           innovations, likelihood);
  ASSERT_EQ(record.size(), 32u);
  for (const int search : {0, 1}) {
    const SlidingFinding found = detector.look(search);
    InformationSweep<ForwardRecord<2>> information(2, 2);
    SignalSweep<ForwardRecord<2>, double> signal(2, 2);
    const Profile profile = ramp();
    const auto direction = only(search == 0 ? 0 : 2);
    double drop = -1.0, amplitude = 0.0;
    Time onset = 0;
    ASSERT_TRUE(onset_sweep(
        record, profile, direction.data(),
        [&](const auto& m, std::size_t i, double weight) {
          information.take(m, weight, profile.output());
          signal.take(m, weight, profile.output(), innovations[i]);
        },
        [&](std::size_t i) {
          const Detectability at = detectability(information.now(), profile.onset());
          if (at.undetectable()) return;
          const double num = signal.numerator(profile.onset())(0);
          if (num * at.inverse(0, 0) * num < drop) return;
          drop = num * at.inverse(0, 0) * num;
          amplitude = at.inverse(0, 0) * num;
          onset = window[i].valid;
        },
        [&](const auto& m, const auto& A) {
          information.move(m, A);
          signal.move(m, A);
        }));
    EXPECT_EQ(found.onset, onset);
    EXPECT_TRUE(same_bits(found.drop, drop));
    EXPECT_TRUE(same_bits(found.amplitude(0), amplitude));
  }
}

TEST(SlidingDetector, SeesARampAndNoneWhereThereIsNone) {
  const SpeedSystem system = speed_system();
  Filter filter(system, broad(system), 0);
  SlidingDetector<SpeedSystem, 120> detector(system);
  for (const std::size_t sensor : {0u, 1u})
    ASSERT_EQ(detector.add(ramp(), only(sensor), 1e-6), ConfigStatus::ok);
  Random random(8);
  desync::StepError error;
  for (int k = 1; k <= 200; ++k) {
    const Time now = k * 100 * millisecond;
    const double fault = k > 140 ? 0.1 * (k - 140) * 1.0 : 0.0;  // 1 m/s² from 14 s on
    ASSERT_EQ(filter.push(now, 0, 20.0 + fault + random.normal(), k), Status::ok);
    ASSERT_EQ(filter.push(now + 30 * millisecond, 1, 20.0 + 0.5 * random.normal(), k), Status::ok);
    ASSERT_EQ(filter.estimate(now, error), Status::ok);
    detector.take(filter);
    if (k == 140) {
      EXPECT_EQ(detector.look(0).finding, Finding::nothing);
    }
  }
  const SlidingFinding found = detector.look(0);
  EXPECT_EQ(found.finding, Finding::fault);
  EXPECT_NEAR(static_cast<double>(found.onset) / second, 14.0, 1.0);
  EXPECT_NEAR(found.amplitude(0), 1.0, 4 * found.deviation(0));
}

TEST(SlidingDetector, AFixedWindowHasRoomForStatesOfAnyNumber) {
  using Belief = Gaussian<Eigen::Dynamic, double, 3>;
  SlidingRecord<Eigen::Dynamic, 3, 4> fixed(2);
  SlidingRecord<Eigen::Dynamic, 3, -1> chosen(2, 4);
  const Eigen::Vector2d k(0.5, 0.25), h(1.0, 0.0);
  const Eigen::Matrix2d F = Eigen::Matrix2d::Identity();
  const Innovation<Belief> innovation{1.0, 2.0, 0.5, Belief::Vector(k)};
  for (int i = 0; i < 6; ++i) {
    fixed.add(innovation, DenseRow<Eigen::Vector2d>{h}, 1.0 + i, F, 0.1, i % 3, i);
    chosen.add(innovation, DenseRow<Eigen::Vector2d>{h}, 1.0 + i, F, 0.1, i % 3, i);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(fixed[i].noise, 3.0 + static_cast<double>(i));
    EXPECT_EQ(fixed[i].noise, chosen[i].noise);
    EXPECT_EQ(fixed[i].transition.F(1, 1), 1.0);
    EXPECT_EQ(fixed.valid(i), chosen.valid(i));
    EXPECT_EQ(fixed[i].channel, chosen[i].channel);
  }
}

TEST(SlidingDetector, AnEmptyWindowAndRefusedSearches) {
  const SpeedSystem system = speed_system();
  SlidingDetector<SpeedSystem, 8, 1> detector(system);
  EXPECT_EQ(detector.add(ramp(), {}, 1e-3), ConfigStatus::not_positive);
  EXPECT_EQ(detector.add(ramp(), only(7), 1e-3), ConfigStatus::not_positive);  // no such sensor
  EXPECT_EQ(detector.add(ramp(), only(0), 0.0), ConfigStatus::risk);
  EXPECT_EQ(detector.add(ramp(), only(0), 1.0), ConfigStatus::risk);
  auto direction = only(0);
  direction[5] = std::nan("");
  EXPECT_EQ(detector.add(ramp(), direction, 1e-3), ConfigStatus::not_finite);
  EXPECT_EQ(detector.searches(), 0);
  ASSERT_EQ(detector.add(ramp(), only(0), 1e-3), ConfigStatus::ok);
  EXPECT_EQ(detector.add(ramp(), only(1), 1e-3), ConfigStatus::wrong_size);  // no room
  EXPECT_EQ(detector.look(0).finding, Finding::undetectable);
}

TEST(SlidingDetector, TheTailsAreThoseOfChiSquared) {
  for (int q = 1; q <= Profile::max_size; ++q)
    for (const double x : {0.0, 0.3, 2.0, 15.0, 90.0}) {
      const double truth = chi_squared_tail(x, q);
      EXPECT_NEAR(ratio_tail(x, q), truth, 1e-14 * truth) << q << " " << x;
    }
}

TEST(SlidingDetector, AProfileThatOverflowsInTheWindowIsNotLookedFor) {
  const SpeedSystem system = speed_system();
  Filter filter(system, broad(system), 0);
  Detector detector(system);
  Profile grown;
  const Profile::Matrix one = Profile::Matrix::Ones(1, 1);
  ASSERT_EQ(Profile::make(10.0 * one, Profile::Vector::Ones(1), one, grown), ConfigStatus::ok);
  ASSERT_EQ(detector.add(grown, only(0), 1e-3), ConfigStatus::ok);
  desync::StepError error;
  for (const Time now : {second, 2 * second, 102 * second}) {  // e^{10·100} is no number
    ASSERT_EQ(filter.push(now, 0, 20.0, 0), Status::ok);
    ASSERT_EQ(filter.estimate(now, error), Status::ok);
    detector.take(filter);
    const SlidingFinding found = detector.look(0);
    const bool good = now < 100 * second;
    EXPECT_EQ(found.finding, good ? Finding::nothing : Finding::undetectable) << now;
    EXPECT_EQ(found.onsets > 0, good) << now;
  }
}

TEST(SlidingDetector, AGapTooLongForTheModelForgetsTheState) {
  // ẋ = x: over 400 s twice e^{400}, over both at once no number.
  using Unstable = System<LinearModel<1>>;
  Unstable system{LinearModel<1>(LinearModel<1>::Matrix(1.0), LinearModel<1>::Matrix(0.0))};
  ASSERT_EQ(system.add(sensor<Unstable>(Eigen::Matrix<double, 1, 1>(1.0), 2.0)), ConfigStatus::ok);
  const auto known =
      system.initial({Unstable::ModelBelief::Vector(0.0), Unstable::ModelBelief::Matrix(0.0)});
  desync::Filter<Unstable, 8> filter(system, known, 0);
  SlidingDetector<Unstable, 8> detector(system);
  ASSERT_EQ(detector.add(Profile::pulse(), {1.0}, 1e-3), ConfigStatus::ok);
  desync::StepError error;
  ASSERT_EQ(filter.push(0, 0, 1.0, 0), Status::ok);
  for (const Time now : {Time{0}, 400 * second, 800 * second}) {
    if (now == 800 * second) {
      ASSERT_EQ(filter.push(now, 0, 14.0, 1), Status::ok);
    }
    ASSERT_EQ(filter.estimate(now, error), Status::ok);
    detector.take(filter);
  }
  ASSERT_EQ(detector.record().size(), 2u);
  EXPECT_EQ(detector.record()[1].elapsed, 800.0);
  EXPECT_EQ(detector.record()[1].transition.F(0, 0), 0.0);
  const SlidingFinding found = detector.look(0);
  EXPECT_EQ(found.finding, Finding::fault);
  EXPECT_EQ(found.onset, 800 * second);
  EXPECT_NEAR(found.drop, 49.0, 1e-12);  // (14/2)²
}

}  // namespace
}  // namespace surefix::drift
