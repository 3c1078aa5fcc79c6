// The speed of a train from a wheel sensor, a Doppler radar and a receiver that is 150 ms late,
// each of which may be out or drift: which of them is wrong, and limits that hold the speed but for
// 1e-11.
//
//   M,stamp [ns since the start],sensor (0 wheel, 1 radar, 2 receiver),speed [m/s]
//   E,time [ns]         an estimate is wanted
//
// writes time, speed, lower and upper limit, and of each sensor the probability that it is healthy,
// or time and why there is none; at the end how many measurements were taken and refused.
#include <surefix/core/integrator_chain.hpp>
#include <surefix/core/system.hpp>
#include <surefix/robust/filter.hpp>
#include <surefix/version.hpp>

#include "counters.hpp"
#include "lines.hpp"

namespace {

using surefix::ConfigStatus;
using surefix::Status;
using System = surefix::System<surefix::ConstantAcceleration, 0, 0, 3>;
using Faults = surefix::robust::FaultSystem<System, 3>;  // all three may drift
using Filter = surefix::robust::Filter<Faults, 64>;

constexpr int sensors = 3;
constexpr double risk = 1e-11;  // of each estimate

/// Three sensors of the speed, as good as they are.
[[nodiscard]] bool configure(System& system) {
  const double sigma[sensors] = {1.0, 0.5, 0.2};  // [m/s]
  const surefix::Time latency[sensors] = {0, 30'000'000, 150'000'000};
  for (int s = 0; s < sensors; ++s) {
    System::SensorType sensor;
    sensor.observes << 1.0, 0.0;
    sensor.sigma = sigma[s];
    sensor.latency = latency[s];
    if (system.add(sensor) != ConfigStatus::ok) return false;
  }
  return system.check() == ConfigStatus::ok;
}

/// Out for a second, or off by 20 m/s (1 σ) and wandering for five, once in 200 s each.
[[nodiscard]] bool add_modes(surefix::robust::SensorModes& modes) {
  surefix::robust::FaultMode out;
  out.kind = surefix::robust::FaultKind::outage;
  out.span = 100.0;  // [m/s] over which its readings may be
  out.rate = 0.005;
  out.duration = 1.0;
  surefix::robust::FaultMode drift;
  drift.kind = surefix::robust::FaultKind::drifting;
  drift.sigma = 20.0;
  drift.walk = 1.0;
  drift.rate = 0.005;
  drift.duration = 5.0;
  return modes.add(out) == ConfigStatus::ok && modes.add(drift) == ConfigStatus::ok;
}

}  // namespace

int main() {
  if (!surefix::fits_library()) return refused("a library that is not the headers'");
  System system(surefix::ConstantAcceleration(0.08));  // root density of the jerk [m/s³/√Hz]
  surefix::robust::SensorModes modes;
  if (!configure(system) || !add_modes(modes)) return refused("sensors or modes");

  surefix::robust::FilterSetup<Faults> setup{
      Faults(system), {}, {}, {}, {{1.0, 0.0}, risk, surefix::robust::Sides::both}};
  setup.carry.components = 27;
  const std::vector<surefix::robust::SensorModes> all(sensors, modes);
  if (setup.system.make(all) != ConfigStatus::ok ||
      setup.table.make(all, sensors) != ConfigStatus::ok ||
      setup.prior.make(surefix::robust::ModePrior::Kind::chains, all) != ConfigStatus::ok)
    return refused("hypotheses");

  System::ModelBelief start;  // anything up to 40 m/s
  start.x << 20.0, 0.0;
  start.P << 100.0, 0.0, 0.0, 1.0;
  static Filter filter(setup, system.initial(start), 0);
  // From here on nothing allocates.
  static Lines lines;
  surefix::robust::RobustEstimate estimate;
  long long bad = 0;
  for (long long row = 0; lines.next(); ++row) {
    const bool message = lines.is('M', 3), wanted = lines.is('E', 1);
    const auto time = lines.whole<surefix::Time>(0);
    if (message) {
      const auto sensor = lines.whole<std::int32_t>(1);
      const double speed = lines.number(2);
      if (!lines.bad()) (void)filter.push(time, sensor, speed, row);  // refused ones are counted
    } else if (wanted && !lines.bad()) {
      const Status status = filter.estimate(time, estimate);
      if (status != Status::ok) {
        std::printf("%lld,%s\n", static_cast<long long>(time), surefix::name(status));
        continue;
      }
      std::printf("%lld,%.3f,%.3f,%.3f", static_cast<long long>(time), estimate.x[0],
                  estimate.lower, estimate.upper);
      for (int s = 0; s < sensors; ++s)
        std::printf(",%.6f",
                    estimate.mode_probability[s * surefix::robust::SensorModes::max_modes]);
      std::printf("\n");
    }
    bad += lines.bad() || !(message || wanted);
  }
  print(filter.counters(), bad);
  return Lines::finish();
}
