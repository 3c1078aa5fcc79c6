// The streaming robust filter: the same face as the linear one. No heap after construction.
#pragma once

#include <optional>

#include "surefix/desync/intake.hpp"
#include "surefix/desync/step_buffer.hpp"
#include "surefix/robust/estimate.hpp"
#include "surefix/robust/measurement_report.hpp"

namespace surefix::robust {

/// All that a robust filter is made from.
template <class FaultSystem>
struct FilterSetup {
  FaultSystem system;
  ModeTable table;
  ModePrior prior;
  Carry carry;
  LimitRequest limits;
  PerMeasurement per_measurement{};
  bool noise = false;  ///< whether a stream estimates the noise of its measurements
};

/// `Capacity`: measurements that a step can hold, or −1 for one chosen at construction.
template <class FaultSystem, int Capacity = 64>
class Filter {
 public:
  using Belief = typename FaultSystem::Base::Belief;

  /// Starts at `start` from `belief` over the base system's states; without a start, at the
  /// earliest measurement of the first step.
  Filter(const FilterSetup<FaultSystem>& setup, const Belief& belief, std::optional<Time> start,
         std::size_t capacity = static_cast<std::size_t>(Capacity))
      : recursion_(setup.system, setup.table, setup.prior, setup.carry, setup.per_measurement,
                   capacity),
        evaluation_(recursion_, setup.limits),
        initial_(belief),
        started_(start.has_value()),
        oldest_(start.value_or(0)) {
    if constexpr (Capacity < 0) buffer_ = desync::StepBuffer<Capacity>(capacity);
    if (setup.noise) recursion_.estimate_noise();
    report_.reserve(capacity);
    recursion_.start(initial_, oldest_);
  }

  /// Takes a measurement of `sensor` with its time stamp [ns]: in any order, as long as it was
  /// valid after the last estimate.
  [[nodiscard]] Status push(Time stamp, std::int32_t sensor, double value, std::int64_t id,
                            double factor = 1.0) noexcept {
    const desync::Intake intake{started_, oldest_, largest_value};
    Measurement m;
    Status status = admit(recursion_.system().base(), intake, stamp, sensor, value, id, m, factor);
    if (status == Status::ok) status = buffer_.push(m);
    counters_.count(status);
    return status;
  }

  /// Ends the step at `time` ≥ the last estimate's. On any status but ok nothing changes.
  [[nodiscard]] Status estimate(Time time, RobustEstimate& out) noexcept {
    const std::size_t ready = buffer_.ready(time);
    Status status = in_range(time) ? Status::ok : Status::not_finite;
    if (status == Status::ok && !started_) recursion_.start(initial_, first_time(ready, time));
    if (status == Status::ok && time < recursion_.time()) status = Status::time_backwards;
    if (status == Status::ok)
      status = recursion_.advance(ready > 0 ? &buffer_[0] : nullptr, ready, time);
    if (status != Status::ok) {
      counters_.count(status);
      return status;
    }
    for (std::size_t i = 0; i < ready; ++i)
      if (recursion_.status(i) != Status::ok) counters_.move(Status::ok, recursion_.status(i));
    started_ = true;
    oldest_ = time + 1;
    write_report(ready);
    buffer_.pop(ready);
    out = evaluation_(recursion_);
    return status;
  }

  /// Continues from what was saved of a filter made from the same.
  [[nodiscard]] Status restore(const MixtureState& state, bool started, Time oldest,
                               const Counters& counters, const Measurement* waiting,
                               std::size_t count) {
    if (count > buffer_.capacity()) return Status::buffer_full;
    recursion_.restore(state);
    started_ = started;
    oldest_ = oldest;
    counters_ = counters;
    report_.clear();
    buffer_.clear();
    for (std::size_t i = 0; i < count; ++i) (void)buffer_.push(waiting[i]);
    return Status::ok;
  }

  /// Of every measurement used in the last step, in order of validity.
  [[nodiscard]] const std::vector<MeasurementReport>& report() const noexcept { return report_; }
  [[nodiscard]] bool started() const noexcept { return started_; }
  [[nodiscard]] Time oldest() const noexcept { return oldest_; }
  [[nodiscard]] const Recursion<FaultSystem>& recursion() const noexcept { return recursion_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const desync::StepBuffer<Capacity>& buffer() const noexcept { return buffer_; }

 private:
  void write_report(std::size_t ready) noexcept {
    report_.clear();
    for (std::size_t i = 0; i < ready; ++i) {
      if (recursion_.status(i) != Status::ok) continue;
      const std::size_t used = report_.size();
      MeasurementReport row;
      row.id = buffer_[i].id;
      row.sensor = buffer_[i].sensor;
      if (recursion_.per_measurement()) row.outlier = recursion_.outlier(used);
      if (recursion_.estimates_noise()) {
        row.noise = recursion_.noise(used).noise;
        row.noise_variance = recursion_.noise(used).variance;
      }
      report_.push_back(row);  // within what is reserved
    }
  }
  [[nodiscard]] Time first_time(std::size_t ready, Time time) const noexcept {
    return ready > 0 ? buffer_[0].valid : time;
  }

  Recursion<FaultSystem> recursion_;
  Evaluation evaluation_;
  Belief initial_;
  bool started_;
  Time oldest_;
  Counters counters_{};
  std::vector<MeasurementReport> report_;
  desync::StepBuffer<Capacity> buffer_{};
};

}  // namespace surefix::robust
