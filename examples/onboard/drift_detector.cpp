// A ramp hidden in one of three speed sensors, looked for in the last 300 measurements after every
// step (Parellier, Barrau & Bonnabel 2023, with the exact likelihood ratio over all onsets).
//
//   M,stamp [ns since the start],sensor (0 wheel, 1 radar, 2 receiver),speed [m/s]
//   E,time [ns]         a step ends
//
// writes of each sensor: time, sensor, finding, onset [ns], slope [m/s²] and its standard error,
// and a bound on the probability that this is a false alarm. Of several that contradict each other
// the one with the smallest bound is wrong. At the end, how many measurements were taken
// and refused.
#include <surefix/core/integrator_chain.hpp>
#include <surefix/core/system.hpp>
#include <surefix/drift/sliding_detector.hpp>
#include <surefix/version.hpp>

#include "counters.hpp"
#include "lines.hpp"

namespace {

using surefix::ConfigStatus;
using surefix::Status;
using System = surefix::System<surefix::ConstantAcceleration, 0, 0, 3>;
using Filter = surefix::desync::Filter<System, 64>;
using Detector = surefix::drift::SlidingDetector<System, 300>;

constexpr int searches = 3;           // one for each sensor
constexpr double false_alarm = 1e-6;  // of each search

[[nodiscard]] bool configure(System& system) {
  for (const double sigma : {0.1, 0.3, 0.2}) {  // [m/s]
    System::SensorType sensor;
    sensor.observes << 1.0, 0.0;
    sensor.sigma = sigma;
    if (system.add(sensor) != ConfigStatus::ok) return false;
  }
  return system.check() == ConfigStatus::ok;
}

/// s' = (s₁, 0): the fault is s₀, its slope the amplitude.
[[nodiscard]] bool add_ramps(Detector& detector) {
  surefix::drift::Profile::Matrix A(2, 2), onset(2, 1);
  A << 0.0, 1.0, 0.0, 0.0;
  onset << 0.0, 1.0;
  surefix::drift::Profile ramp;
  if (surefix::drift::Profile::make(A, Eigen::Vector2d(1.0, 0.0), onset, ramp) != ConfigStatus::ok)
    return false;
  for (std::size_t s = 0; s < searches; ++s) {
    Detector::Direction direction{};
    direction[s] = 1.0;
    if (detector.add(ramp, direction, false_alarm) != ConfigStatus::ok) return false;
  }
  return true;
}

/// What a cycle does: a function of its own, so that its stack and its time can be stated. Anything
/// but ok if there is no estimate.
[[gnu::noinline]] Status step(Filter& filter, Detector& detector, surefix::Time time,
                              std::array<surefix::drift::SlidingFinding, searches>& found) {
  surefix::desync::StepError error;
  const Status status = filter.estimate(time, error);
  if (status != Status::ok) return status;
  detector.take(filter);
  for (int search = 0; search < searches; ++search)
    found[static_cast<std::size_t>(search)] = detector.look(search);
  return status;
}

}  // namespace

int main() {
  if (!surefix::fits_library()) return refused("a library that is not the headers'");
  System system(surefix::ConstantAcceleration(0.05));
  if (!configure(system)) return refused("sensors");
  System::ModelBelief start;
  start.x << 20.0, 0.0;
  start.P << 100.0, 0.0, 0.0, 1.0;
  static Filter filter(system, system.initial(start), 0);
  static Detector detector(system);
  if (!add_ramps(detector)) return refused("searches");
  // From here on nothing allocates.
  static Lines lines;
  constexpr const char* names[] = {"undetectable", "nothing", "fault"};
  std::array<surefix::drift::SlidingFinding, searches> all;
  long long bad = 0;
  for (long long row = 0; lines.next(); ++row) {
    const bool message = lines.is('M', 3), wanted = lines.is('E', 1);
    const auto time = lines.whole<surefix::Time>(0);
    if (message) {
      const auto sensor = lines.whole<std::int32_t>(1);
      const double speed = lines.number(2);
      if (!lines.bad()) (void)filter.push(time, sensor, speed, row);  // refused ones are counted
    } else if (wanted && !lines.bad()) {
      const Status status = step(filter, detector, time, all);
      if (status != Status::ok) {
        std::printf("%lld,%s\n", static_cast<long long>(time), surefix::name(status));
        continue;
      }
      for (int search = 0; search < searches; ++search) {
        const auto& found = all[static_cast<std::size_t>(search)];
        std::printf("%lld,%d,%s", static_cast<long long>(time), search,
                    names[static_cast<int>(found.finding)]);
        if (found.finding != surefix::drift::Finding::undetectable)
          std::printf(",%lld,%.4f,%.4f,%.2e", static_cast<long long>(found.onset),
                      found.amplitude(0), found.deviation(0), found.p_bound);
        std::printf("\n");
      }
    }
    bad += lines.bad() || !(message || wanted);
  }
  print(filter.counters(), bad);
  return Lines::finish();
}
