// A whole log at once: the same recursion, so the same bits as measurement by measurement.
#pragma once

#include <vector>

#include "surefix/desync/batch_request.hpp"
#include "surefix/desync/noise_estimate.hpp"
#include "surefix/desync/recursion.hpp"
#include "surefix/desync/sorted_log.hpp"

namespace surefix::desync {

/// x (n) and P (n × n) into plain arrays.
template <class Belief>
SUREFIX_INLINE void write(const Belief& belief, double* x, double* P) noexcept {
  constexpr int N = Belief::fixed_size;
  const int n = belief.size();
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    x[j] = belief.x(j);
    loop<N>(n, [&](int i) SUREFIX_LAMBDA { P[j * n + i] = belief.P(i, j); });
  });
}

/// The records of a batch, and where their noise goes; nothing at all where it is not asked for.
template <class System, NoiseScope scope>
class NoiseWriter {
 public:
  NoiseWriter(const System& system, const BatchOutput& out, std::size_t count)
      : system_(system), out_(out) {
    if (scope == NoiseScope::journey) records_.reserve(count);
  }
  void keep(const Record<System>& record) {
    if constexpr (scope != NoiseScope::none) records_.push_back(record);
  }
  void end_step() {
    if constexpr (scope == NoiseScope::step) write();
  }
  void end_journey() {
    if constexpr (scope == NoiseScope::journey) write();
  }

 private:
  void write() {
    estimate_noise(system_, records_.data(), records_.size(),
                   [&](std::size_t, const NoiseEstimate& estimate) {
                     out_.noise[estimate.id] = estimate.value;
                     out_.noise_variance[estimate.id] = estimate.variance;
                   });
    records_.clear();
  }

  const System& system_;
  const BatchOutput& out_;
  std::vector<Record<System>> records_;
};

/// One batch under way. The state is a local of the loops, so that it may live in registers.
template <class System, NoiseScope scope>
class BatchRun {
  using State = RecursionState<typename System::Belief>;

 public:
  BatchRun(const System& system, const SortedLog& sorted, const BatchOutput& out)
      : system_(system), sorted_(sorted), out_(out), noise_(system, out, sorted.size()) {}

  /// Measurements valid before the start are too late; returns the first that is not.
  [[nodiscard]] std::size_t skip(Time oldest) const noexcept {
    std::size_t next = 0;
    for (; next < sorted_.size() && sorted_[next].valid < oldest; ++next)
      out_.status[sorted_[next].id] = Status::too_late;
    return next;
  }

  /// An estimate at every distinct validity time at which a row was used.
  SUREFIX_INLINE Status at_every_measurement(State& target, std::size_t& made) {
    State state = target;
    const std::size_t count = sorted_.size();
    std::size_t done = 0;
    Status status = Status::ok;
    for (std::size_t next = skip(state.oldest); next < count && status == Status::ok; ++next) {
      const Measurement m = sorted_[next];
      use(state, m);
      if (next + 1 < count && sorted_[next + 1].valid == m.valid) continue;
      if (state.step.degrees == 0) continue;
      status = close(state, m.valid, done);
      if (status == Status::ok) ++done;
    }
    return finish(state, status, done, target, made);
  }

  /// Estimates at the times of the request.
  SUREFIX_INLINE Status at_times(const BatchRequest& request, State& target, std::size_t& made) {
    State state = target;
    const std::size_t count = sorted_.size();
    std::size_t next = skip(state.oldest), done = 0;
    Status status = Status::ok;
    for (; done < request.T; ++done) {
      const Time time = request.times[done];
      status = check_end(state, time);
      if (status != Status::ok) break;
      for (; next < count && sorted_[next].valid <= time; ++next) {
        const Measurement m = sorted_[next];
        const bool late = request.delay != any_delay && sorted_.stamp(next) > time + request.delay;
        if (late) out_.status[m.id] = Status::too_late;
        if (!late) use(state, m);
      }
      status = close(state, time, done);
      if (status != Status::ok) break;
    }
    for (; next < count; ++next) out_.status[sorted_[next].id] = Status::waiting;
    return finish(state, status, done, target, made);
  }

 private:
  SUREFIX_INLINE void use(State& state, const Measurement& m) {
    Record<System> record;
    const Status status = absorb(system_, state, m, record);
    if (status == Status::ok) {
      noise_.keep(record);
    } else {
      out_.status[m.id] = status;
    }
  }
  SUREFIX_INLINE Status close(State& state, Time time, std::size_t estimate) {
    const std::size_t n = static_cast<std::size_t>(system_.state_size());
    StepError error;
    const Status status = close_step(system_, state, time, error);
    if (status != Status::ok) return status;
    out_.time[estimate] = seconds(time);
    out_.sse[estimate] = error.sse;
    out_.degrees[estimate] = error.degrees;
    write(state.belief, out_.x + estimate * n, out_.P + estimate * n * n);
    noise_.end_step();
    return status;
  }
  SUREFIX_INLINE Status finish(const State& state, Status status, std::size_t done, State& target,
                               std::size_t& made) {
    made = done;
    if (status != Status::ok) return status;
    noise_.end_journey();
    assign(target, state);
    return status;
  }

  const System& system_;
  const SortedLog& sorted_;
  const BatchOutput out_;
  NoiseWriter<System, scope> noise_;
};

template <NoiseScope scope, class System>
Status run_batch(const System& system, RecursionState<typename System::Belief>& target,
                 const SortedLog& sorted, const BatchRequest& request, const BatchOutput& out,
                 std::size_t& made) {
  BatchRun<System, scope> run(system, sorted, out);
  return request.times == nullptr ? run.at_every_measurement(target, made)
                                  : run.at_times(request, target, made);
}

/// Runs `target` over a sorted log. Stops at the first estimate that cannot be made and returns
/// its status; `made` counts the estimates before it.
template <class System>
Status run_batch(const System& system, RecursionState<typename System::Belief>& target,
                 const SortedLog& sorted, const BatchRequest& request, const BatchOutput& out,
                 std::size_t& made) {
  switch (request.scope) {
    case NoiseScope::step:
      return run_batch<NoiseScope::step>(system, target, sorted, request, out, made);
    case NoiseScope::journey:
      return run_batch<NoiseScope::journey>(system, target, sorted, request, out, made);
    default:
      return run_batch<NoiseScope::none>(system, target, sorted, request, out, made);
  }
}

}  // namespace surefix::desync
