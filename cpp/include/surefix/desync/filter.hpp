// The streaming filter: measurements are pushed as they arrive, estimates are asked for when they
// are needed. No heap after construction (none at all with a fixed capacity).
#pragma once

#include <limits>

#include "surefix/desync/intake.hpp"
#include "surefix/desync/noise_estimate.hpp"
#include "surefix/desync/recursion.hpp"
#include "surefix/desync/step_buffer.hpp"

namespace surefix::desync {

/// `Capacity`: measurements that a step can hold, or −1 for one chosen at construction.
template <class System, int Capacity = 64>
class Filter {
 public:
  using Belief = typename System::Belief;
  using State = RecursionState<Belief>;

  /// Starts at `start` from `belief` there.
  Filter(const System& system, const Belief& belief, Time start) noexcept
      : system_(system), state_(start_state(belief, start)), started_(true) {}
  /// Starts at the earliest measurement of the first step, from `belief` there.
  Filter(const System& system, const Belief& belief) noexcept
      : system_(system), state_(start_state(belief, 0)), started_(false) {}

  /// For Capacity −1: room for `capacity` measurements a step. Drops what waits in the buffer.
  void reserve(std::size_t capacity) {
    buffer_ = StepBuffer<Capacity>(capacity);
    records_ = typename Storage<Record<System>>::type(capacity);
  }

  /// Takes a measurement of `sensor` with its time stamp [ns]: in any order, as long as it was
  /// valid after the last estimate. `id` is the caller's and comes back with its noise estimate;
  /// `factor`: of the sensor's standard deviation, of a reading that says how good it is.
  [[nodiscard]] Status push(Time stamp, std::int32_t sensor, double value, std::int64_t id,
                            double factor = 1.0) noexcept {
    const Intake intake{started_, state_.oldest, std::numeric_limits<double>::max()};
    Measurement m;
    Status status = admit(system_, intake, stamp, sensor, value, id, m, factor);
    if (status == Status::ok) status = buffer_.push(m);
    counters_.count(status);
    return status;
  }

  /// Ends the step at `time` ≥ the last estimate's: uses all measurements valid until then, gives
  /// the step's SSE; the belief is `state().belief`. On any status but ok nothing changes, except
  /// that the noise of the step before may be gone.
  [[nodiscard]] Status estimate(Time time, StepError& error) noexcept {
    const std::size_t ready = buffer_.ready(time);
    State state = state_;
    if (!started_) state.time = state.oldest = ready > 0 ? buffer_[0].valid : time;
    Counters counters = counters_;
    std::size_t used = 0, tried = 0;
    Status status = check_end(state, time);
    for (; tried < ready && status == Status::ok; ++tried) {
      const Status absorbed = absorb(system_, state, buffer_[tried], records_[used]);
      if (absorbed == Status::ok) ++used;
      if (absorbed != Status::ok) counters.move(Status::ok, absorbed);
    }
    if (status == Status::ok) status = close_step(system_, state, time, error);
    if (status != Status::ok) {
      counters_.count(status);
      if (tried > 0) used_ = 0;  // what was tried lies where the records of the last step were
      return status;
    }
    assign(state_, state);
    counters_ = counters;
    started_ = true;
    used_ = used;
    buffer_.pop(ready);
    return Status::ok;
  }

  /// Noise of the measurements of the last step (eqs. 25-26): calls `store(i, NoiseEstimate)` for
  /// i = `used()` − 1 … 0 in order of validity.
  template <class Store>
  void noise(Store&& store) const noexcept {
    estimate_noise(system_, records_.data(), used_, store);
  }

  /// The records of the last step, `used()` of them in order of validity.
  [[nodiscard]] const Record<System>* records() const noexcept { return records_.data(); }
  /// Number of measurements used in the last step.
  [[nodiscard]] std::size_t used() const noexcept { return used_; }
  [[nodiscard]] bool started() const noexcept { return started_; }
  [[nodiscard]] const System& system() const noexcept { return system_; }
  [[nodiscard]] const State& state() const noexcept { return state_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const StepBuffer<Capacity>& buffer() const noexcept { return buffer_; }

  /// Continues from what was saved: state, counters and the measurements that waited. Refuses, and
  /// stays as it was, what no filter can have saved: it may come from a file.
  [[nodiscard]] Status restore(const State& state, bool started, const Counters& counters,
                               const Measurement* waiting, std::size_t count) noexcept {
    if (count > buffer_.capacity()) return Status::buffer_full;
    if (!in_range(state.time)) return Status::not_finite;
    if (state.oldest < state.time) return Status::time_backwards;
    for (std::size_t i = 0; i < count; ++i) {
      const Status status = check_waiting(waiting[i], state, started);
      if (status != Status::ok) return status;
    }
    state_ = state;
    started_ = started;
    counters_ = counters;
    used_ = 0;
    buffer_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const Status status = buffer_.push(waiting[i]);
      if (status != Status::ok) counters_.move(Status::ok, status);  // it waits already
    }
    return Status::ok;
  }

 private:
  template <class T>
  using Storage = FixedOrReserved<T, Capacity>;

  /// What `admit` would have said; the stamp itself is never formed, it might overflow.
  [[nodiscard]] Status check_waiting(const Measurement& m, const State& state,
                                     bool started) const noexcept {
    if (m.sensor < 0 || m.sensor >= system_.sensor_count()) return Status::unknown_sensor;
    const Time latency = system_.sensor(m.sensor).latency;
    const bool timed = -max_time - latency <= m.valid && m.valid <= max_time - latency;
    const bool good = smallest_factor <= m.factor && m.factor <= largest_factor;
    if (!std::isfinite(m.value) || !timed || !good) return Status::not_finite;
    return started && m.valid < state.oldest ? Status::too_late : Status::ok;
  }

  System system_;
  State state_;
  bool started_;
  Counters counters_{};
  StepBuffer<Capacity> buffer_{};
  typename Storage<Record<System>>::type records_{};
  std::size_t used_ = 0;
};

}  // namespace surefix::desync
