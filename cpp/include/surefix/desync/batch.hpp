// A whole log at once: the same recursion, so the same bits as measurement by measurement.
#pragma once

#include <algorithm>
#include <vector>

#include "surefix/desync/noise_estimate.hpp"
#include "surefix/desync/recursion.hpp"

namespace surefix::desync {

/// A log in the order of its rows: `count` stamps [ns], sensors (index, −1 if unknown), values.
struct LogView {
  const Time* stamp;
  const std::int32_t* sensor;
  const double* value;
  std::size_t count;
};

/// Stamp of a row whose time was NaN, infinite or out of range.
inline constexpr Time no_time = std::numeric_limits<Time>::min();

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
  const Time* times;  ///< (T) ascending [ns]; null: one estimate at every distinct validity time
  std::size_t T;
  NoiseScope scope;
  /// The estimate for t is made when the clock says t + delay [ns, ≥ 0]: rows with a later stamp
  /// are too late for it, as they would be onboard.
  Time delay = any_delay;
};

/// Where a batch writes; arrays of T estimates of n states and of N rows, never null but where said.
struct BatchOutput {
  Time* time;              ///< (T) [ns]
  double* x;               ///< (T, n)
  double* P;               ///< (T, n, n)
  double* sse;             ///< (T)
  std::int32_t* degrees;   ///< (T)
  Status* status;          ///< (N) what became of every row
  double* noise;           ///< (N) v̂, NaN where the row was not used; null for NoiseScope::none
  double* noise_variance;  ///< (N), as `noise`
};

/// Sorts the usable rows by validity into `sorted`; writes the status of all others.
template <class System>
void sort_log(const System& system, const LogView& log, std::vector<Measurement>& sorted,
              Status* status) {
  sorted.clear();
  sorted.reserve(log.count);
  bool in_order = true;
  for (std::size_t i = 0; i < log.count; ++i) {
    const std::int32_t s = log.sensor[i];
    if (s < 0 || s >= system.sensor_count()) {
      status[i] = Status::unknown_sensor;
    } else if (!std::isfinite(log.value[i]) || log.stamp[i] == no_time) {
      status[i] = Status::not_finite;
    } else {
      const Measurement m{log.stamp[i] - system.sensor(s).latency, log.value[i],
                          static_cast<std::int64_t>(i), s};
      in_order = in_order && (sorted.empty() || before(sorted.back(), m));
      sorted.push_back(m);
      status[i] = Status::ok;
    }
  }
  if (in_order) return;  // strictly, so nothing is repeated either
  std::stable_sort(sorted.begin(), sorted.end(), before);
  const auto last = std::unique(sorted.begin(), sorted.end(),
                                [&](const Measurement& a, const Measurement& b) {
                                  const bool again = repeats(a, b);
                                  if (again) status[b.id] = Status::repeated;
                                  return again;
                                });
  sorted.erase(last, sorted.end());
}

/// How many different validity times there are in a sorted log from `start` on.
[[nodiscard]] inline std::size_t distinct_times(const std::vector<Measurement>& sorted,
                                                Time start) noexcept {
  std::size_t n = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i)
    if (sorted[i].valid >= start && (i == 0 || sorted[i].valid != sorted[i - 1].valid)) ++n;
  return n;
}

/// Runs `target` over a sorted log. Stops at the first estimate that cannot be made and returns
/// its status; `made` counts the estimates before it.
template <class System>
Status run_batch(const System& system, RecursionState<typename System::Belief>& target,
                 const std::vector<Measurement>& sorted, const BatchRequest& request,
                 const BatchOutput& out, std::size_t& made) {
  RecursionState<typename System::Belief> state = target;  // local: it may live in registers
  const std::size_t n = static_cast<std::size_t>(system.state_size());
  const bool keep_all = request.scope == NoiseScope::journey;
  const bool keep_any = request.scope != NoiseScope::none;
  std::vector<Record<System>> records;
  if (keep_all) records.reserve(sorted.size());
  Record<System> record;
  const auto write_noise = [&] {
    estimate_noise(system, records.data(), records.size(),
                   [&](std::size_t, const NoiseEstimate& estimate) {
                     out.noise[estimate.id] = estimate.value;
                     out.noise_variance[estimate.id] = estimate.variance;
                   });
  };
  const auto arrives_after = [&](const Measurement& m, Time time) {
    return request.delay != any_delay &&
           m.valid + system.sensor(m.sensor).latency > time + request.delay;
  };

  std::size_t next = 0;
  for (; next < sorted.size() && sorted[next].valid < state.oldest; ++next)
    out.status[sorted[next].id] = Status::too_late;
  for (made = 0; made < request.T; ++made) {
    const Time time = request.times != nullptr ? request.times[made] : sorted[next].valid;
    if (time < state.time) return Status::time_backwards;
    for (; next < sorted.size() && sorted[next].valid <= time; ++next) {
      const Status status = arrives_after(sorted[next], time)
                                ? Status::too_late
                                : absorb(system, state, sorted[next], record);
      if (status != Status::ok) out.status[sorted[next].id] = status;
      if (status == Status::ok && keep_any) records.push_back(record);
    }
    StepError error;
    const Status closed = close_step(system, state, time, error);
    if (closed != Status::ok) return closed;
    out.time[made] = time;
    out.sse[made] = error.sse;
    out.degrees[made] = error.degrees;
    for (std::size_t i = 0; i < n; ++i) out.x[made * n + i] = state.belief.x.data()[i];
    for (std::size_t i = 0; i < n * n; ++i) out.P[made * n * n + i] = state.belief.P.data()[i];
    if (request.scope == NoiseScope::step) {
      write_noise();
      records.clear();
    }
  }
  for (; next < sorted.size(); ++next) out.status[sorted[next].id] = Status::waiting;
  if (keep_all) write_noise();
  target = state;
  return Status::ok;
}

}  // namespace surefix::desync
