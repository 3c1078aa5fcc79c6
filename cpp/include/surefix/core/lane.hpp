// The engine's arithmetic runs on a lane: a double, or a pack of doubles that go through the same
// instructions side by side. Beliefs that share F, h and r and differ in x, P and the innovation
// (runs of a batch, modes, hypotheses) are updated by the same code, a pack at a time.
#pragma once

#include <Eigen/Core>

namespace surefix {

/// K doubles in step with one another.
template <int K>
using Pack = Eigen::Array<double, K, 1>;

/// True if the lane is positive and finite (in every member of a pack). NaN is not.
[[nodiscard]] inline bool positive(double value) noexcept {
  return value > 0.0 && value <= 1.7976931348623157e308;
}
template <int K>
[[nodiscard]] bool positive(const Pack<K>& value) noexcept {
  return (value > 0.0).all() && (value <= 1.7976931348623157e308).all();
}

}  // namespace surefix
