// The system of the benchmarks in C++: the speed, and three radars.
#pragma once

#include "surefix/core/any_system.hpp"

namespace benchmark {

constexpr double jerk = 0.08, sigma[3] = {2.0, 1.0, 0.5};

inline surefix::SpeedSystem make_system() {
  surefix::SpeedSystem system{surefix::ConstantAcceleration(jerk)};
  for (const double s : sigma) {
    surefix::SpeedSystem::SensorType sensor;
    sensor.observes = {1.0, 0.0};
    sensor.sigma = s;
    (void)system.add(sensor);
  }
  return system;
}

}  // namespace benchmark
