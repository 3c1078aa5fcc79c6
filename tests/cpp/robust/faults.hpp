// Fault modes and filters that the tests of `robust` share.
#pragma once

#include "surefix/robust/any_filter.hpp"
#include "systems.hpp"

namespace surefix::robust::test {

using namespace surefix::test;

inline FaultMode outage(double rate = 0.005, double duration = 1.0) {
  FaultMode mode;
  mode.kind = FaultKind::outage;
  mode.span = 100.0;
  mode.probability = 0.01;
  mode.rate = rate;
  mode.duration = duration;
  return mode;
}

inline FaultMode drifting(double rate = 0.005, double duration = 5.0) {
  FaultMode mode;
  mode.kind = FaultKind::drifting;
  mode.sigma = 20.0;
  mode.walk = 1.0;
  mode.probability = 0.01;
  mode.rate = rate;
  mode.duration = duration;
  return mode;
}

inline FaultMode frozen() {
  FaultMode mode = outage();
  mode.kind = FaultKind::frozen;
  mode.resolution = 0.1;
  mode.change = 1e-3;
  return mode;
}

inline SensorModes modes(std::initializer_list<FaultMode> faults) {
  SensorModes out;
  for (const FaultMode& fault : faults) EXPECT_EQ(out.add(fault), ConfigStatus::ok);
  return out;
}

using SpeedFaults = FaultSystem<SpeedSystem, 3>;

/// The speed system, all sensors of which may be out or drift.
inline FilterSetup<SpeedFaults> speed_setup(Carry::Kind kind = Carry::Kind::merge,
                                            int components = 27) {
  const std::vector<SensorModes> all(3, modes({outage(), drifting()}));
  FilterSetup<SpeedFaults> setup{SpeedFaults(speed_system()),
                                 {},
                                 {},
                                 {kind, components, 1e-14, 5.0},
                                 {{1.0, 0.0}, 1e-11, Sides::both}};
  EXPECT_EQ(setup.system.make(all), ConfigStatus::ok);
  EXPECT_EQ(setup.table.make(all, 3), ConfigStatus::ok);
  EXPECT_EQ(setup.prior.make(ModePrior::Kind::chains, all), ConfigStatus::ok);
  return setup;
}

}  // namespace surefix::robust::test
