// Noise that has digits as a whole, but for rounding, and in a part has none.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "surefix/core/observation.hpp"

namespace surefix::test {

/// R that an observation of three components takes, and one of the last two of them does not.
///
/// Given the second, the third has 1e-14 of its variance left, which is the limit: on which side of
/// it rounding puts it depends on what was factorised before.
inline Eigen::Matrix3d singular_in_part() {
  using S = LinearSizes<1, 3>;
  for (int k = 0; k < 10000; ++k) {
    const double variance = 1.0 + 1e-3 * k, left = 1e-14 * (1.0 + 1e-3 * (k % 100));
    const double covariance = variance * std::sqrt(1.0 - left);
    Eigen::Matrix3d R;
    R << 1.0, 0.3, 0.3, 0.3, variance, covariance, 0.3, covariance, variance;
    Observation<S> all;
    Observation<Reduced<S>> part;
    MeasuredOf<Reduced<S>> values;
    if (all.make(Eigen::Vector3d::Ones(), R) == ConfigStatus::ok &&
        !part.reduce(all, MeasuredOf<S>(std::nan(""), 1.0, 2.0), values))
      return R;
  }
  ADD_FAILURE() << "rounding makes no such noise";
  return Eigen::Matrix3d::Identity();
}

}  // namespace surefix::test
