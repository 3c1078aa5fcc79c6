// What a batch is asked for, and where it writes.
#pragma once

#include <cstdint>
#include <limits>

#include "surefix/core/status.hpp"
#include "surefix/core/time.hpp"

namespace surefix::desync {

/// Which measurements the noise of a measurement is estimated from.
enum class NoiseScope : std::uint8_t {
  none,
  step,     ///< those of its own step and the past: the paper's v̂_k|k, as streaming gives it
  journey,  ///< all of the log, later ones too (eq. 23 for the whole journey)
};

/// No limit on how late a row may have been logged.
inline constexpr Time any_delay = std::numeric_limits<Time>::max();

/// What a batch is asked for.
struct BatchRequest {
  /// (T) ascending [ns]; null: one estimate at every distinct validity time at which a row is used
  const Time* times;
  std::size_t T;
  NoiseScope scope;
  /// The estimate for t is made when the clock says t + delay [ns, ≥ 0]: rows with a later stamp
  /// are too late for it, as they would be onboard.
  Time delay = any_delay;
};

/// Where a batch writes; arrays of T estimates of n states and of N rows, never null but where
/// said.
struct BatchOutput {
  double* time;            ///< (T) [s]
  double* x;               ///< (T, n)
  double* P;               ///< (T, n, n)
  double* sse;             ///< (T)
  std::int32_t* degrees;   ///< (T)
  Status* status;          ///< (N) what became of every row
  double* noise;           ///< (N) v̂, written where the status is ok; null for NoiseScope::none
  double* noise_variance;  ///< (N), as `noise`
};

}  // namespace surefix::desync
