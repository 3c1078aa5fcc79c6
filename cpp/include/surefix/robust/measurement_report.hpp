// What the last step of a stream says of one of its measurements.
#pragma once

#include <cstdint>
#include <limits>

namespace surefix::robust {

struct MeasurementReport {
  static constexpr double none = std::numeric_limits<double>::quiet_NaN();

  std::int64_t id = 0;           ///< the caller's
  std::int32_t sensor = 0;       ///< index in the system
  double outlier = none;         ///< probability, for hypotheses per measurement
  double noise = none;           ///< v̂ under the most probable hypothesis, if asked for
  double noise_variance = none;  ///< its variance
};

}  // namespace surefix::robust
