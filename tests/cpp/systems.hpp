// The systems and logs that the tests share.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "printing.hpp"
#include "random.hpp"
#include "surefix/core/any_system.hpp"

namespace surefix::test {

constexpr Time second = 1'000'000'000;
constexpr Time millisecond = 1'000'000;
constexpr Time year = 31'557'600 * second;

template <class System, class Observes>
typename System::SensorType sensor(const Observes& observes, double sigma, Time latency = 0,
                                   GaussMarkov scale = {}, GaussMarkov bias = {}) {
  typename System::SensorType out;
  out.observes = observes;
  out.sigma = sigma;
  out.latency = latency;
  out.scale = scale;
  out.bias = bias;
  return out;
}

/// [speed, acceleration] watched by a wheel sensor, a radar and a receiver that is 150 ms late.
inline SpeedSystem speed_system() {
  SpeedSystem system{ConstantAcceleration(0.08)};
  const Eigen::Vector2d speed{1.0, 0.0};
  (void)system.add(sensor<SpeedSystem>(speed, 1.0));
  (void)system.add(sensor<SpeedSystem>(speed, 0.5, 30 * millisecond));
  (void)system.add(sensor<SpeedSystem>(speed, 0.2, 150 * millisecond));
  return system;
}

inline AnySystem::ModelBelief any_belief(const Eigen::VectorXd& x, const Eigen::MatrixXd& P) {
  return {x, P};
}

/// The speed system as a configuration describes it.
inline AnySystem any_speed_system() {
  AnySystem system{AnyModel(ConstantAcceleration(0.08))};
  const Eigen::Vector2d speed{1.0, 0.0};
  (void)system.add(sensor<AnySystem>(speed, 1.0));
  (void)system.add(sensor<AnySystem>(speed, 0.5, 30 * millisecond));
  (void)system.add(sensor<AnySystem>(speed, 0.2, 150 * millisecond));
  return system;
}

/// [position, speed, acceleration | wheel scale, wheel bias, receiver bias]: six states.
inline AnySystem train_system() {
  AnySystem system{AnyModel(ConstantAccelerationWithPosition(0.08))};
  const Eigen::Vector3d position{1.0, 0.0, 0.0}, speed{0.0, 1.0, 0.0};
  (void)system.add(sensor<AnySystem>(speed, 0.1, 0, {0.02, 600.0}, {0.1, 10.0}));
  (void)system.add(sensor<AnySystem>(speed, 0.5, 30 * millisecond));
  (void)system.add(sensor<AnySystem>(position, 3.0, 150 * millisecond, {}, {2.0}));
  return system;
}

/// A belief of the system's size with every model state at `mean` and independent variances.
template <class System>
typename System::Belief broad(const System& system, double mean = 20.0, double variance = 100.0) {
  const int n = system.model_size();
  typename System::ModelBelief model;
  model.x = System::ModelBelief::Vector::Constant(n, mean);
  model.P = System::ModelBelief::Matrix::Identity(n, n) * variance;
  return system.initial(model);
}

struct Row {
  Time stamp;
  std::int32_t sensor;
  double value;
};

/// A random log in the order of arrival: irregular, sensors interleaved, all stamps after `from`.
template <class System>
std::vector<Row> random_log(const System& system, int rows, std::uint64_t seed,
                            Time from = second) {
  Random random(seed);
  std::vector<Row> log;
  Time now = from;
  for (int i = 0; i < rows; ++i) {
    now += static_cast<Time>(random.uniform(0.0, 60e6));
    if (i % 7 == 0) now += millisecond - now % millisecond;  // some stamps coincide with others
    const std::int32_t s = random.integer(system.sensor_count());
    log.push_back({now, s, 20.0 + 3.0 * random.normal()});
  }
  return log;
}

}  // namespace surefix::test
