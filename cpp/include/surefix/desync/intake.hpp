// What a filter asks of a measurement before it takes it.
#pragma once

#include <cmath>

#include "surefix/core/status.hpp"
#include "surefix/desync/measurement.hpp"

namespace surefix::desync {

/// Since when a filter takes measurements, and up to which size.
struct Intake {
  bool started;    ///< before it has, nothing is too late
  Time oldest;     ///< validity that is not [ns]
  double largest;  ///< |value|
};

/// Puts a reading with its time stamp [ns] at the time at which it was valid: ok, or why it is not
/// taken. `factor`: of the sensor's standard deviation.
template <class System>
[[nodiscard]] Status admit(const System& system, const Intake& intake, Time stamp,
                           std::int32_t sensor, double value, std::int64_t id, Measurement& out,
                           double factor = 1.0) noexcept {
  if (sensor < 0 || sensor >= system.sensor_count()) return Status::unknown_sensor;
  if (!(std::abs(value) <= intake.largest) || !in_range(stamp)) return Status::not_finite;
  if (!(smallest_factor <= factor && factor <= largest_factor)) return Status::not_finite;
  out = {stamp - system.sensor(sensor).latency, value, id, sensor, factor};
  return intake.started && out.valid < intake.oldest ? Status::too_late : Status::ok;
}

}  // namespace surefix::desync
