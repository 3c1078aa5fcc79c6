// Hypotheses per measurement, in place of those per sensor: what they are told.
#pragma once

#include <cstddef>
#include <vector>

namespace surefix::robust {

/// How an outlier of one sensor is weighed against a healthy measurement.
struct OutlierPrior {
  double log_healthy = 0.0;  ///< log (1 − p)
  double log_outlier = 0.0;  ///< log p − log span; −∞ where the sensor has no outliers
};

/// Each measurement of a step is healthy or an outlier on its own.
struct PerMeasurement {
  static constexpr int max_measurements = 64;  ///< of a step

  std::size_t capacity = 0;         ///< hypotheses at a time, a multiple of 4, ≥ 8; 0: per sensor
  std::vector<OutlierPrior> prior;  ///< of every sensor
  int max_outliers = max_measurements;  ///< at once in a step; the mass of more is lost
};

}  // namespace surefix::robust
