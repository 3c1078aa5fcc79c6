// The desynchronized filter (Bilenne 2004, table 1), the fast way: one scalar update for each
// measurement at the time at which it was valid. It gives the numbers of the composite step
// (`composite_step.hpp`), which is the same thing when Υ is block diagonal.
#pragma once

#include <limits>

#include "surefix/core/log_likelihood.hpp"
#include "surefix/desync/backward_sweep.hpp"
#include "surefix/desync/measurement.hpp"

namespace surefix::desync {

/// Sum of squared errors of one step, SSE_k = γᵀΓ⁻¹γ = Σ ν_i²/S_i (eq. 27): χ² with `degrees`
/// degrees of freedom when nothing is wrong.
struct StepError {
  double sse = 0.0;
  std::int32_t degrees = 0;
};

/// All that changes while a filter runs: a plain value.
template <class Belief>
struct RecursionState {
  Belief belief;
  Time time;    ///< at which the belief holds [ns]
  Time oldest;  ///< the earliest validity that can still be used: the start, or after the last step
  LogLikelihood likelihood{};
  StepError step{};  ///< of the step under way
};

/// The state of a filter that starts at `start` from `belief`.
template <class Belief>
[[nodiscard]] RecursionState<Belief> start_state(const Belief& belief, Time start) noexcept {
  return {belief, start, start};
}

/// to ← from, the belief component by component as in `assign` of a Gaussian.
template <class Belief>
SUREFIX_INLINE void assign(RecursionState<Belief>& to,
                           const RecursionState<Belief>& from) noexcept {
  assign(to.belief, from.belief);
  to.time = from.time;
  to.oldest = from.oldest;
  to.likelihood = from.likelihood;
  to.step = from.step;
}

/// Moves `belief` from one time to a later one. Only on ok is it to be used.
template <class System>
[[nodiscard]] SUREFIX_INLINE Status move(const System& system, typename System::Belief& belief,
                                         Time from, Time to) noexcept {
  if (to == from) return Status::ok;
  typename System::Transition transition;
  const Status status = system.transition(to - from, transition);
  if (status != Status::ok) return status;
  predict(belief, transition);
  return Status::ok;
}

/// Predicts to `m.valid` ≥ `state.time` and updates. On any status but ok the state is unchanged:
/// `numerical` if ν²/S is not a finite number.
template <class System>
[[nodiscard]] SUREFIX_INLINE Status absorb(const System& system,
                                           RecursionState<typename System::Belief>& state,
                                           const Measurement& m, Record<System>& record) noexcept {
  typename System::Belief belief = state.belief;
  const Status moved = move(system, belief, state.time, m.valid);
  if (moved != Status::ok) return moved;
  const Reading reading = system.read(m.sensor, belief.x);
  const double sigma = m.factor * system.sensor(m.sensor).sigma;
  const double innovation = m.value - reading.predicted;
  const bool updated = system.with_row(
      m.sensor, reading.at, belief, [&](const auto& row, auto& value) SUREFIX_LAMBDA {
        return update(value, row, sigma * sigma, innovation, record.innovation);
      });
  if (!updated) return Status::numerical;
  const double square = innovation * innovation / record.innovation.variance;
  if (!(square <= std::numeric_limits<double>::max())) return Status::numerical;
  record.valid = m.valid;
  record.id = m.id;
  record.sensor = m.sensor;
  record.factor = m.factor;
  record.at = reading.at;
  assign(state.belief, belief);
  state.time = m.valid;
  state.likelihood.add_variance(record.innovation.variance);
  state.step.sse += square;
  ++state.step.degrees;
  return Status::ok;
}

/// Whether a step can end at `time`, as far as its time goes; to be asked before any of its
/// measurements is used.
template <class Belief>
[[nodiscard]] SUREFIX_INLINE Status check_end(const RecursionState<Belief>& state,
                                              Time time) noexcept {
  if (!in_range(time)) return Status::not_finite;
  return time < state.time ? Status::time_backwards : Status::ok;
}

/// Ends a step at `time` ≥ `state.time`: moves the belief there and gives the step's SSE. On any
/// status but ok the state is unchanged.
template <class System>
[[nodiscard]] SUREFIX_INLINE Status close_step(const System& system,
                                               RecursionState<typename System::Belief>& state,
                                               Time time, StepError& error) noexcept {
  typename System::Belief belief = state.belief;
  const Status moved = move(system, belief, state.time, time);
  if (moved != Status::ok) return moved;
  if (!is_finite(belief)) return Status::numerical;
  assign(state.belief, belief);
  state.time = time;
  state.oldest = time + 1;
  state.likelihood.add_squares(state.step.sse, state.step.degrees);
  error = state.step;
  state.step = {};
  return Status::ok;
}

}  // namespace surefix::desync
