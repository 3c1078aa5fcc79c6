// What a step function answers. Every measurement and every request gets one of these; none is
// dropped in silence (each is counted in `Counters`).
#pragma once

#include <array>
#include <cstdint>

namespace surefix {

enum class Status : std::uint8_t {
  ok = 0,          ///< done; a measurement was used, or waits in the step buffer
  not_finite,      ///< value or time is NaN or infinite (or beyond 95 years): not used
  unknown_sensor,  ///< no sensor of that index or name: not used
  too_late,        ///< valid at or before the last estimate, or before the start: not used
  repeated,        ///< same sensor, same validity time, same value as one in the step: used once
  buffer_full,     ///< the step buffer holds its capacity: not used; estimate, then push again
  off_grid,        ///< a discrete model has no transition over this duration: not used
  numerical,       ///< innovation variance not positive, or the prediction overflows: not used
  waiting,         ///< valid after the last estimate of a batch: not used yet
  time_backwards,  ///< an estimate was asked for before the last one: state unchanged
};

inline constexpr int status_count = 10;

/// Short name of a status, as it appears in event tables.
constexpr const char* name(Status status) noexcept {
  constexpr std::array<const char*, status_count> names{
      "ok",          "not_finite", "unknown_sensor", "too_late", "repeated",
      "buffer_full", "off_grid",   "numerical",      "waiting",  "time_backwards",
  };
  return names[static_cast<std::size_t>(status)];
}

/// How often each status was answered.
class Counters {
 public:
  void count(Status status) noexcept { ++counts_[static_cast<std::size_t>(status)]; }
  /// What was counted as `from` has become `to`.
  void move(Status from, Status to) noexcept {
    --counts_[static_cast<std::size_t>(from)];
    count(to);
  }
  [[nodiscard]] std::int64_t operator[](Status status) const noexcept {
    return counts_[static_cast<std::size_t>(status)];
  }
  [[nodiscard]] const std::array<std::int64_t, status_count>& all() const noexcept {
    return counts_;
  }
  void restore(const std::array<std::int64_t, status_count>& counts) noexcept { counts_ = counts; }

 private:
  std::array<std::int64_t, status_count> counts_{};
};

/// What is wrong with a configuration; reported before the first step.
enum class ConfigStatus : std::uint8_t {
  ok = 0,
  wrong_size,           ///< a vector or matrix does not fit the model's state
  not_finite,           ///< a parameter is NaN or infinite, or its square is
  negative,             ///< a standard deviation or density is negative
  not_positive,         ///< sigma (or its square), a time constant or a period is not above zero
  not_semidefinite,     ///< a covariance is not exactly symmetric and positive semidefinite
  too_many_sensors,     ///< more sensors than the system has room for
  sensor_states,        ///< the sensors' error states do not fill the system's fixed size
  too_many_modes,       ///< more fault modes than a sensor has room for, or two that drift
  too_many_hypotheses,  ///< more combinations of modes than are ever enumerated
  prior,  ///< no distribution: probabilities not in (0, 1), rates or durations not > 0
  risk,   ///< a risk outside (0, 1)
};

/// Short name of a configuration's status, for messages.
constexpr const char* name(ConfigStatus status) noexcept {
  constexpr std::array<const char*, 12> names{
      "ok",
      "wrong size",
      "not finite",
      "negative",
      "not positive",
      "not symmetric and positive semidefinite",
      "too many sensors",
      "the sensors' states do not fit",
      "too many fault modes for a sensor",
      "too many hypotheses",
      "no probability distribution",
      "a risk outside (0, 1)",
  };
  return names[static_cast<std::size_t>(status)];
}

}  // namespace surefix
