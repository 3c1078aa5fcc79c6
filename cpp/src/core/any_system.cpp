#include "surefix/core/any_system.hpp"

namespace surefix {

bool as_speed_system(const AnySystem& system, SpeedSystem& out) noexcept {
  const auto* model = std::get_if<ConstantAcceleration>(&system.model().get());
  if (model == nullptr || system.state_size() != SpeedSystem::size) return false;
  SpeedSystem speed(*model);
  for (int s = 0; s < system.sensor_count(); ++s) {
    const auto& any = system.sensor(s);
    if (any.observes(0) != 1.0 || any.observes(1) != 0.0) return false;
    SpeedSystem::SensorType sensor;
    sensor.observes = {1.0, 0.0};
    sensor.sigma = any.sigma;
    sensor.latency = any.latency;
    if (speed.add(sensor) != ConfigStatus::ok) return false;
  }
  out = speed;
  return true;
}

}  // namespace surefix
