// Hours of simulated time through every system, measurements at 100 Hz and the track monitor's
// epochs at 1 Hz, with random faults and random bad input: nothing that is not a number comes out,
// every message of the speed filters is counted, and the heap stays as it was after a tenth of the
// time.
//
// Usage: soak HOURS. Prints one line of figures; fails if the promise does not hold.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>

#include "raim/epochs.hpp"
#include "robust/faults.hpp"
#include "surefix/drift/sliding_detector.hpp"
#include "surefix/raim/follower.hpp"
#include "switching/switching.hpp"

namespace {

using namespace surefix;
using namespace surefix::test;

constexpr Time period = 10 * millisecond;
constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

long failures = 0;
void expect(bool good, const char* what, long step) {
  if (!good && ++failures < 10) std::printf("step %ld: %s\n", step, what);
}

/// Bytes by which the heap in use has grown, of all systems, while each of them ran.
long grown = 0;

/// Looks at the heap when a tenth of the steps is done, and when all are.
class Heap {
 public:
  explicit Heap(long steps) : first_(steps / 10) {}
  void look(long step) {
    if (step == first_) before_ = in_use();
  }
  void end() const { grown += in_use() - before_; }

 private:
  static long in_use() {
    const auto now = mallinfo2();
    return static_cast<long>(now.uordblks + now.hblkhd);
  }
  long first_, before_ = 0;
};

/// Speed of a train, and what its sensors say of it in one period: at times wrong for seconds.
class Journey {
 public:
  explicit Journey(std::uint64_t seed) : random_(seed) {}

  /// Calls push(stamp, sensor, value) for the messages of the period that ends at `now`; returns
  /// how many there were.
  template <class Push>
  int period(Time now, Push&& push) {
    truth_ += 0.002 * (20.0 - truth_) + 0.02 * random_.normal();
    if (random_.uniform() < 2e-4) fault_ = random_.integer(3), left_ = 100 + random_.integer(900);
    if (left_ > 0 && --left_ == 0) fault_ = -1;
    int count = 0;
    for (int s = 0; s < 3; ++s) {
      if (random_.uniform() < 0.3) continue;  // lost
      double value = truth_ + (s == 0 ? 1.0 : s == 1 ? 0.5 : 0.2) * random_.normal();
      if (s == fault_) value += 0.02 * left_;
      Time stamp = now - static_cast<Time>(random_.uniform() * 9.0) * millisecond;
      if (s > 0) stamp += s == 1 ? 30 * millisecond : 150 * millisecond;
      push(stamp, s, value);
      ++count;
      if (random_.uniform() < 0.01) push(stamp, s, value), ++count;  // repeated
      if (random_.uniform() < 0.01) bad(now, push), ++count;
    }
    return count;
  }
  [[nodiscard]] double truth() const { return truth_; }

 private:
  template <class Push>
  void bad(Time now, Push&& push) {
    switch (random_.integer(8)) {
      case 0:
        return push(now, 0, none);
      case 1:
        return push(now, 1, infinite);
      case 2:
        return push(now, 2, -1e300);
      case 3:
        return push(now - 3600 * second, 0, 20.0);
      case 4:
        return push(std::numeric_limits<Time>::max(), 0, 20.0);
      case 5:
        return push(std::numeric_limits<Time>::min(), 1, 20.0);
      case 6:
        return push(now, random_.integer(1000) - 500, 20.0);
      default:
        return push(now, 0, 1e9 * random_.normal());
    }
  }

  Random random_;
  double truth_ = 20.0;
  int fault_ = -1, left_ = 0;
};

long total(const Counters& counters) {
  long sum = 0;
  for (const std::int64_t count : counters.all()) sum += count;
  return sum;
}

/// The filter and its sliding window; then the mixture of fault hypotheses, every tenth period.
void speed(long steps) {
  const SpeedSystem system = speed_system();
  const auto made = std::make_unique<desync::Filter<SpeedSystem, 64>>(system, broad(system), 0);
  desync::Filter<SpeedSystem, 64>& filter = *made;
  const auto window = std::make_unique<drift::SlidingDetector<SpeedSystem, 60>>(system);
  auto& detector = *window;
  drift::Profile::Matrix A(2, 2), onset(2, 1);
  A << 0.0, 1.0, 0.0, 0.0;
  onset << 0.0, 1.0;
  drift::Profile ramp;
  (void)drift::Profile::make(A, Eigen::Vector2d(1.0, 0.0), onset, ramp);
  (void)detector.add(ramp, {1.0}, 1e-6);
  Journey journey(1);
  long pushed = 0;
  Heap heap(steps);
  for (long step = 1; step <= steps; ++step) {
    heap.look(step);
    const Time now = second + step * period;
    pushed += journey.period(
        now, [&](Time stamp, int s, double value) { (void)filter.push(stamp, s, value, step); });
    desync::StepError error;
    const Status status = filter.estimate(now, error);
    expect(status == Status::ok && is_finite(filter.state().belief), "the speed filter", step);
    detector.take(filter);
    if (step % 100 == 0) expect(!std::isnan(detector.look(0).p_bound), "the detector", step);
  }
  heap.end();
  // Estimates that were made are not counted, refused messages are.
  expect(total(filter.counters()) == pushed, "a message was not counted", steps);
}

void mixture(long steps) {
  const SpeedSystem system = speed_system();
  using Filter = robust::Filter<robust::test::SpeedFaults, 64>;
  const auto made = std::make_unique<Filter>(
      robust::test::speed_setup(robust::Carry::Kind::merge, 9), broad(system), 0);
  Filter& filter = *made;
  Journey journey(2);
  long pushed = 0;
  Heap heap(steps);
  for (long step = 1; step <= steps; ++step) {
    heap.look(step);
    const Time now = second + step * period;
    pushed += journey.period(
        now, [&](Time stamp, int s, double value) { (void)filter.push(stamp, s, value, step); });
    if (step % 10 != 0) continue;
    robust::RobustEstimate e;
    const Status status = filter.estimate(now, e);
    expect(status == Status::ok, "the robust filter refuses a step", step);
    if (status != Status::ok) continue;
    expect(std::isfinite(e.x[0]) && e.P[0] > 0.0 && !std::isnan(e.lower) && !std::isnan(e.upper) &&
               e.lower <= e.upper,
           "the robust filter", step);
  }
  heap.end();
  expect(total(filter.counters()) == pushed, "a message was not counted", steps);
}

void switched(long steps) {
  const switching::testing::Prepared prepared;
  switching::Filter<switching::Method::one_step, switching::testing::Two> filter;
  (void)filter.make(switching::testing::four_modes(), prepared.system.initial());
  Random random(3);
  Heap heap(steps);
  for (long step = 0; step < steps; ++step) {
    heap.look(step);
    switching::Measured<switching::testing::Two> z;
    const double kind = random.uniform();
    z(0) = kind < 0.01 ? none : kind < 0.02 ? 1e6 * random.normal() : 2.0 * random.normal();
    if (kind > 0.999) z(0) = infinite;
    const Status status = filter.step(prepared.transition(), prepared.observation(), z);
    expect(status == (std::isinf(z(0)) ? Status::not_finite : Status::ok), "a switching step",
           step);
    expect(is_finite(filter.estimate()) && filter.mode(0) >= 0.0, "the switching filter", step);
  }
  heap.end();
}

void track(long epochs) {
  const raim::Track line = raim::testing::arc();
  const raim::TrackRaim monitor(line, {});
  raim::Follower follower(monitor, 30.0, 0.0);
  Random random(4);
  Heap heap(epochs);
  for (long epoch = 0; epoch < epochs; ++epoch) {
    heap.look(epoch);
    const double l = 250.0 * std::sin(0.01 * double(epoch));
    auto sky = raim::testing::epoch(line, l, 4 + random.integer(9), 2, random);
    if (random.uniform() < 0.1) sky[1].pseudorange += 1000.0 * random.normal();
    if (random.uniform() < 0.05) sky[2].pseudorange = random.uniform() < 0.5 ? none : 1e300;
    if (random.uniform() < 0.05) sky[0].sigma = random.uniform() < 0.5 ? -1.0 : 1e-300;
    if (random.uniform() < 0.02) sky[3].position = sky[2].position;
    const raim::Verdict v = follower.judge(double(epoch), sky.data(), static_cast<int>(sky.size()));
    const bool usable = v.declared == raim::Declared::ok || v.declared == raim::Declared::excluded;
    expect(!usable || (std::isfinite(v.along) && !std::isnan(v.protection)), "the monitor", epoch);
    expect(usable || v.declared == raim::Declared::alarm || std::isnan(v.protection),
           "a number that is not available", epoch);
  }
  heap.end();
}

}  // namespace

int main(int count, char** arguments) {
  const double hours = count > 1 ? std::atof(arguments[1]) : 0.1;
  const auto steps = static_cast<long>(hours * 360'000.0);
  speed(steps);
  mixture(steps);
  switched(steps);
  track(steps / 100);
  std::printf("%g h: %ld failures, heap grown by %ld bytes\n", hours, failures, grown);
  return failures == 0 && grown <= 0 ? 0 : 1;
}
