// One scalar measurement, placed at the time at which it was valid.
#pragma once

#include <cstdint>

#include "surefix/core/time.hpp"

namespace surefix::desync {

/// A reading `value` of sensor `sensor`, true at `valid` = its stamp − the sensor's latency.
struct Measurement {
  Time valid;           ///< [ns]
  double value;         ///< [unit of the sensor]
  std::int64_t id;      ///< the user's: row of a log, number of a push
  std::int32_t sensor;  ///< index in the system
  double factor = 1.0;  ///< its standard deviation, in units of the sensor's sigma
};

/// A reading may say how good it is: by a factor of its sensor's standard deviation in this range.
inline constexpr double smallest_factor = 1e-6, largest_factor = 1e6;

/// The order in which measurements are used: by validity, ties by sensor, then by value, so that
/// the result does not depend on the order of arrival, to the last bit.
[[nodiscard]] inline bool before(const Measurement& a, const Measurement& b) noexcept {
  if (a.valid != b.valid) return a.valid < b.valid;
  if (a.sensor != b.sensor) return a.sensor < b.sensor;
  return a.value < b.value;
}

/// The same sensor saying the same thing about the same time: a repeated message, which carries no
/// second piece of information. (Equal stamps with different values are two measurements.)
[[nodiscard]] inline bool repeats(const Measurement& a, const Measurement& b) noexcept {
  return a.valid == b.valid && a.sensor == b.sensor && a.value == b.value;
}

}  // namespace surefix::desync
