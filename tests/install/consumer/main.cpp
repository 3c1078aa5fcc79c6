// The speed of a train from three sensors, as a program on board would do it: everything has a
// fixed size, nothing allocates, nothing throws, every status is looked at.
//
// Build with CMake (`find_package(surefix)`) or
//   g++ -std=c++17 -O2 main.cpp $(pkg-config --cflags --libs surefix)

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <surefix/core/distributions.hpp>
#include <surefix/core/integrator_chain.hpp>
#include <surefix/core/system.hpp>
#include <surefix/desync/filter.hpp>

namespace {

using surefix::ConfigStatus;
using surefix::Status;
using surefix::Time;

// State: [speed, acceleration]. The sensors have no error states of their own.
using System = surefix::System<surefix::ConstantAcceleration>;
// Up to 64 measurements can wait between two estimates.
using Filter = surefix::desync::Filter<System, 64>;

constexpr Time millisecond = 1'000'000;  // times are integer nanoseconds

/// Indices of the sensors: the order in which `configure` adds them.
enum SensorIndex : std::int32_t { wheel, radar, gps };

/// Adds the three sensors; false if one of them is not a sensor at all. To be asked once, before
/// the first step: a configuration that passes here never fails later.
[[nodiscard]] bool configure(System& system) {
  System::SensorType sensor;
  sensor.observes << 1.0, 0.0;  // they all read the speed
  sensor.sigma = 1.0;           // m/s: wheels slip and slide
  if (system.add(sensor) != ConfigStatus::ok) return false;
  sensor.sigma = 2.0;  // m/s: radar
  if (system.add(sensor) != ConfigStatus::ok) return false;
  sensor.sigma = 0.5;                  // m/s: GPS,
  sensor.latency = 150 * millisecond;  // whose values are old when they arrive
  if (system.add(sensor) != ConfigStatus::ok) return false;
  return system.check() == ConfigStatus::ok;
}

/// A message from the bus: who says what, and when it arrived. `sensor` is what the message claims.
struct Message {
  Time stamp;
  std::int32_t sensor;
  double value;  // m/s
};

/// Tells the filter; what it cannot use is reported and the journey goes on. Whatever the answer,
/// the filter is in a good state: a bad message is counted, it does not poison the estimate.
void receive(Filter& filter, const Message& message, std::int64_t number) {
  const Status status = filter.push(message.stamp, message.sensor, message.value, number);
  if (status != Status::ok)
    std::printf("message %d: %s\n", static_cast<int>(number), surefix::name(status));
}

/// Asks for the estimate at `time` and prints it with the interval that the true speed leaves with
/// the probability `risk`, if the sensors are as described.
[[nodiscard]] Status report(Filter& filter, Time time, double risk) {
  surefix::desync::StepError error;
  const Status status = filter.estimate(time, error);
  if (status != Status::ok) return status;  // the filter is as it was before the question

  const Filter::Belief& belief = filter.state().belief;
  const double speed = belief.x(0);
  const double half = surefix::normal_two_sided(risk) * std::sqrt(belief.P(0, 0));
  std::printf("t %.1f s: speed %.3f m/s, within [%.3f, %.3f], %d measurements\n",
              surefix::seconds(time), speed, speed - half, speed + half,
              static_cast<int>(error.degrees));
  return Status::ok;
}

}  // namespace

int main() {
  System system(surefix::ConstantAcceleration(0.08));  // root density of the jerk, m/s³/√Hz
  if (!configure(system)) {
    std::printf("the configuration is wrong\n");
    return 1;
  }

  // What is known at the start: 20 m/s ± 1, no acceleration ± 0.1 m/s².
  System::ModelBelief start;
  start.x << 20.0, 0.0;
  start.P << 1.0, 0.0, 0.0, 0.01;
  Filter filter(system, system.initial(start), 0);

  // What the bus brings: GPS late and out of order, a radar that divides by zero, a repeated
  // message, a sensor that nobody knows.
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Message messages[] = {
      {100 * millisecond, wheel, 20.31}, {140 * millisecond, radar, 18.90},
      {200 * millisecond, wheel, 19.72}, {180 * millisecond, gps, 20.12},
      {240 * millisecond, radar, nan},   {300 * millisecond, wheel, 20.94},
      {300 * millisecond, wheel, 20.94}, {340 * millisecond, radar, 22.05},
      {380 * millisecond, gps, 20.21},   {400 * millisecond, 7, 20.0},
  };
  std::int64_t number = 0;
  for (const Message& message : messages) {
    receive(filter, message, number++);
    // An estimate every 200 ms of the messages' time; the GPS of 180 ms came after the wheel of
    // 200 ms and is used all the same, at the 30 ms at which it was true.
    if (number == 4 && report(filter, 200 * millisecond, 1e-11) != Status::ok) return 1;
  }
  if (report(filter, 400 * millisecond, 1e-11) != Status::ok) return 1;

  // A question about the past is answered by a status, not by a number.
  const Status past = report(filter, 300 * millisecond, 1e-11);
  std::printf("an estimate at 0.3 s: %s\n", surefix::name(past));
  return past == Status::time_backwards ? 0 : 1;
}
