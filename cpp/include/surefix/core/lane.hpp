// The engine's arithmetic runs on a lane: a double, or a pack of doubles that go through the same
// instructions side by side. Beliefs that share F, h and r and differ in x, P and the innovation
// (runs of a batch, modes, hypotheses) are updated by the same code, a pack at a time.
#pragma once

#include <cmath>

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
[[nodiscard]] inline bool within(double value, double low, double high) noexcept {
  return !(value < low) && !(value > high);
}
template <int K>
[[nodiscard]] SUREFIX_INLINE bool within(const Pack<K>& value, double low, double high) noexcept {
  return value.minCoeff() >= low && value.maxCoeff() <= high;
}

/// True if every lane is finite.
[[nodiscard]] inline bool finite(double value) noexcept { return value * 0.0 == 0.0; }
template <int K>
[[nodiscard]] SUREFIX_INLINE bool finite(const Pack<K>& value) noexcept {
  return (value * 0.0).sum() == 0.0;
}

/// √v, v ≥ 0; correctly rounded in both.
[[nodiscard]] inline double square_root(double v) noexcept { return std::sqrt(v); }
template <int K>
[[nodiscard]] SUREFIX_INLINE Pack<K> square_root(const Pack<K>& v) noexcept {
  return v.sqrt();
}

/// The greater and the smaller of two, lane by lane.
[[nodiscard]] inline double greater(double a, double b) noexcept { return a > b ? a : b; }
[[nodiscard]] inline double smaller(double a, double b) noexcept { return a < b ? a : b; }
template <int K>
[[nodiscard]] SUREFIX_INLINE Pack<K> greater(const Pack<K>& a, const Pack<K>& b) noexcept {
  return a.max(b);
}
template <int K>
[[nodiscard]] SUREFIX_INLINE Pack<K> smaller(const Pack<K>& a, const Pack<K>& b) noexcept {
  return a.min(b);
}

/// The smallest lane.
[[nodiscard]] inline double least(double v) noexcept { return v; }
template <int K>
[[nodiscard]] SUREFIX_INLINE double least(const Pack<K>& v) noexcept {
  return v.minCoeff();
}

/// Lanes one by one.
template <class Lane>
struct Lanes {
  static constexpr int count = 1;
  [[nodiscard]] static double get(const double& lane, int) noexcept { return lane; }
  static void set(double& lane, int, double value) noexcept { lane = value; }
  [[nodiscard]] static double all(double value) noexcept { return value; }
};
template <int K>
struct Lanes<Pack<K>> {
  static constexpr int count = K;
  [[nodiscard]] static double get(const Pack<K>& lane, int i) noexcept { return lane(i); }
  static void set(Pack<K>& lane, int i, double value) noexcept { lane(i) = value; }
  [[nodiscard]] static Pack<K> all(double value) noexcept { return Pack<K>::Constant(value); }
};

}  // namespace surefix
