// Time as the engine keeps it: integer nanoseconds, so that differences are exact and the same
// bits come out however a journey is cut into steps.
#pragma once

#include <cmath>
#include <cstdint>

namespace surefix {

/// A time or a duration [ns].
using Time = std::int64_t;

/// Largest magnitude of a time [s]: 95 years to either side of zero (of 1970, for Unix time), so
/// that the difference of two times less a latency still fits into 64 bits of nanoseconds.
inline constexpr double max_seconds = 3e9;
inline constexpr Time max_time = static_cast<Time>(max_seconds) * 1'000'000'000;  ///< [ns]
/// Largest magnitude of a latency [s].
inline constexpr double max_latency = 1e6;

/// Whether a time is one that the engine computes with.
constexpr bool in_range(Time time) noexcept { return time >= -max_time && time <= max_time; }

/// Duration in seconds, correctly rounded.
constexpr double seconds(Time duration) noexcept { return static_cast<double>(duration) / 1e9; }

/// Nearest nanosecond to `value` [s]; false, with `out` untouched, if not finite or out of range.
[[nodiscard]] inline bool to_time(double value, Time& out) noexcept {
  if (!(std::abs(value) <= max_seconds)) return false;
  const double whole =
      std::trunc(value);  // apart: the product of a Unix time with 1e9 loses 128 ns
  out = static_cast<Time>(whole) * 1'000'000'000 +
        static_cast<Time>(std::nearbyint((value - whole) * 1e9));
  return true;
}

}  // namespace surefix
