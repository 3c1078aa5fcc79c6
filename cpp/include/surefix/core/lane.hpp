// The engine's arithmetic runs on a lane: a double, or a pack of doubles that go through the same
// instructions side by side. Beliefs that share F, h and r and differ in x, P and the innovation
// (runs of a batch, modes, hypotheses) are updated by the same code, a pack at a time.
#pragma once

#include "surefix/core/loop.hpp"

namespace surefix {

/// K doubles in step with one another.
template <int K>
using Pack = Eigen::Array<double, K, 1>;

/// True if the lane is positive and finite (in every member of a pack). NaN is not.
[[nodiscard]] inline bool positive(double value) noexcept {
  return value > 0.0 && value <= 1.7976931348623157e308;
}
template <int K>
[[nodiscard]] SUREFIX_INLINE bool positive(const Pack<K>& value) noexcept {
  // Without comparisons of lanes, which Eigen makes one by one: 0 · NaN and 0 · ∞ are not 0.
  return (value * 0.0).sum() == 0.0 && value.minCoeff() > 0.0;
}

/// True if no lane is outside [low, high]; lanes that are NaN do not count.
template <int K>
[[nodiscard]] SUREFIX_INLINE bool within(const Pack<K>& value, double low, double high) noexcept {
  return value.minCoeff() >= low && value.maxCoeff() <= high;
}

}  // namespace surefix
