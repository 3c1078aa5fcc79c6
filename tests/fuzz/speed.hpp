// The speed monitor that is fuzzed: three sensors that may be out or drift.
#pragma once

#include "bytes.hpp"
#include "surefix/core/any_system.hpp"
#include "surefix/drift/sliding_detector.hpp"
#include "surefix/robust/filter.hpp"

namespace surefix::fuzz {

class Speed {
 public:
  using Faults = robust::FaultSystem<SpeedSystem, 3>;

  Speed() : system_(ConstantAcceleration(0.08)) {
    const double sigma[] = {1.0, 0.5, 0.2};
    const Time latency[] = {0, 30'000'000, 150'000'000};
    for (int s = 0; s < 3; ++s) {
      SpeedSystem::SensorType sensor;
      sensor.observes << 1.0, 0.0;
      sensor.sigma = sigma[s];
      sensor.latency = latency[s];
      require(system_.add(sensor) == ConfigStatus::ok, "a sensor");
    }
  }
  [[nodiscard]] desync::Filter<SpeedSystem, 64> filter() const { return {system_, start(), 0}; }
  [[nodiscard]] drift::SlidingDetector<SpeedSystem, 60> detector() const {
    drift::SlidingDetector<SpeedSystem, 60> out(system_);
    drift::Profile::Matrix A(2, 2), onset(2, 1);
    A << 0.0, 1.0, 0.0, 0.0;
    onset << 0.0, 1.0;
    drift::Profile ramp;
    require(drift::Profile::make(A, Eigen::Vector2d(1.0, 0.0), onset, ramp) == ConfigStatus::ok,
            "a ramp");
    require(out.add(ramp, {1.0}, 1e-3) == ConfigStatus::ok, "a search");
    return out;
  }
  [[nodiscard]] robust::Filter<Faults, 64> mixture() const {
    robust::FaultMode out, drifts;
    out.kind = robust::FaultKind::outage;
    out.span = 100.0;
    drifts.kind = robust::FaultKind::drifting;
    drifts.sigma = 20.0;
    drifts.walk = 1.0;
    out.rate = drifts.rate = 0.005;
    out.duration = drifts.duration = 1.0;
    robust::SensorModes modes;
    require(modes.add(out) == ConfigStatus::ok && modes.add(drifts) == ConfigStatus::ok, "modes");
    const std::vector<robust::SensorModes> all(3, modes);
    robust::FilterSetup<Faults> setup{
        Faults(system_), {}, {}, {}, {{1.0, 0.0}, 1e-11, robust::Sides::both}};
    setup.carry.components = 6;
    require(setup.system.make(all) == ConfigStatus::ok, "a system");
    require(setup.table.make(all, 3) == ConfigStatus::ok, "a table");
    require(setup.prior.make(robust::ModePrior::Kind::chains, all) == ConfigStatus::ok, "a prior");
    return {setup, start(), 0};
  }

 private:
  [[nodiscard]] SpeedSystem::Belief start() const {
    SpeedSystem::ModelBelief belief;
    belief.x << 20.0, 0.0;
    belief.P << 100.0, 0.0, 0.0, 1.0;
    return system_.initial(belief);
  }

  SpeedSystem system_;
};

}  // namespace surefix::fuzz
