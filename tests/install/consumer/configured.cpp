// The same engine with model and sensors chosen at run time, as a program does that reads them
// from a file: position and speed of a train from a wheel sensor with a wrong wheel diameter and a
// GPS that reads the position.

#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <surefix/core/distributions.hpp>
#include <surefix/desync/any_filter.hpp>

namespace {

using surefix::AnySystem;
using surefix::ConfigStatus;
using surefix::Status;
using surefix::Time;
using surefix::desync::AnyFilter;

constexpr Time millisecond = 1'000'000;

/// A sensor that reads component `reads` of a state of `size` components.
[[nodiscard]] AnySystem::SensorType make_sensor(int size, int reads, double sigma) {
  AnySystem::SensorType sensor;
  sensor.observes = decltype(sensor.observes)::Unit(size, reads);
  sensor.sigma = sigma;
  return sensor;
}

}  // namespace

int main() {
  // [position, speed, acceleration]
  AnySystem system(surefix::AnyModel(surefix::ConstantAccelerationWithPosition(0.08)));
  const int n = system.model_size();

  AnySystem::SensorType wheel = make_sensor(n, 1, 0.1);  // m/s
  wheel.scale.sigma = 0.02;  // 2 %, constant: the filter gains a state that estimates it
  const AnySystem::SensorType gps = make_sensor(n, 0, 2.0);  // m
  if (system.add(wheel) != ConfigStatus::ok || system.add(gps) != ConfigStatus::ok ||
      system.check() != ConfigStatus::ok) {
    std::printf("the configuration is wrong\n");
    return 1;
  }

  AnySystem::ModelBelief start;
  start.x.setZero(n);
  start.P.setZero(n, n);
  start.x(1) = 20.0;                     // m/s
  start.P.diagonal() << 4.0, 1.0, 0.01;  // m², m²/s², m²/s⁴
  const std::unique_ptr<AnyFilter> filter = AnyFilter::make(system, start, Time{0}, 64);

  // A steady 20 m/s for a minute; the wheel reads 1 % too much.
  std::int64_t number = 0;
  for (Time time = 100 * millisecond; time <= 60'000 * millisecond; time += 100 * millisecond) {
    if (filter->push(time, 0, 20.2, number++) != Status::ok) return 1;
    if (time % (1000 * millisecond) != 0) continue;
    if (filter->push(time, 1, 20.0 * surefix::seconds(time), number++) != Status::ok) return 1;
    surefix::desync::StepError error;
    if (filter->estimate(time, error) != Status::ok) return 1;
  }

  const AnySystem::Belief belief = filter->belief();
  const double k = surefix::normal_two_sided(1e-3);
  const int scale = filter->system().scale_state(0);
  std::printf("speed %.2f ± %.2f m/s, wheel reads %.1f ± %.1f %% too much\n", belief.x(1),
              k * std::sqrt(belief.P(1, 1)), 100.0 * belief.x(scale),
              100.0 * k * std::sqrt(belief.P(scale, scale)));
  return 0;
}
