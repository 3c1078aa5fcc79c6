// The forward pass of the desynchronized filter over a log, as a record.
#pragma once

#include <optional>

#include "surefix/desync/recursion.hpp"
#include "surefix/desync/sorted_log.hpp"
#include "surefix/drift/forward_record.hpp"

namespace surefix::drift {

/// F of a system's transition as a matrix.
template <class Transition, class Matrix>
void dense(const Transition& transition, Matrix& F) noexcept {
  F.setIdentity();
  for (int j = 0; j < static_cast<int>(F.cols()); ++j) {
    auto column = F.col(j);
    transition.apply(column);
  }
}

/// Runs the filter from `belief` at `start`, or at the first measurement without one, over the
/// sorted log. `record` and `innovations`, one for each of its measurements, have room for all;
/// `status`: of every row.
template <class System, class Record>
void pass_log(const System& system, const typename System::Belief& belief,
              std::optional<Time> start, const desync::SortedLog& log, Status* status,
              Record& record, LargeArray<double>& innovations, double& log_likelihood) {
  const std::size_t count = log.size();
  auto state = desync::start_state(belief, start.value_or(count > 0 ? log[0].valid : 0));
  typename Record::Belief::Matrix F = belief.P;
  desync::Record<System> passed;
  Time before = state.time;
  for (std::size_t i = 0; i < count; ++i) {
    const desync::Measurement m = log[i];
    status[m.id] =
        m.valid < state.oldest ? Status::too_late : desync::absorb(system, state, m, passed);
    if (status[m.id] != Status::ok) continue;
    const Time elapsed = record.size() > 0 ? m.valid - before : 0;
    typename System::Transition transition;
    if (elapsed > 0 && system.transition(elapsed, transition) == Status::ok) dense(transition, F);
    const double sigma = m.factor * system.sensor(m.sensor).sigma;
    record.add(passed.innovation, system.row(m.sensor, passed.at), sigma * sigma, F,
               seconds(elapsed), m.sensor, m.id);
    innovations[record.size() - 1] = passed.innovation.value;
    before = m.valid;
  }
  state.likelihood.add_squares(state.step.sse, state.step.degrees);
  log_likelihood = state.likelihood.value();
}

}  // namespace surefix::drift
