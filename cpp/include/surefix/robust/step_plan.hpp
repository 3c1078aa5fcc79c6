// What all hypotheses of one step have in common: the legs between its measurements, and the
// log-densities of measurements that a fault mode explains without the state.
#pragma once

#include <vector>

#include "surefix/desync/measurement.hpp"
#include "surefix/robust/fault_system.hpp"

namespace surefix::robust {

using desync::Measurement;

/// The last value of a sensor, which a frozen one repeats.
struct LastValue {
  double value = 0.0;
  bool known = false;
};

template <class FaultSystem>
class StepPlan {
 public:
  using Transition = typename FaultSystem::Transition;

  struct Leg {
    Time elapsed;  ///< [ns]; 0: no transition
    Transition transition;
  };

  StepPlan() = default;
  StepPlan(const FaultSystem& system, std::size_t capacity)
      : legs_(capacity + 1),
        used_(capacity),
        status_(capacity),
        log_density_(static_cast<std::size_t>(system.sensor_count()) * SensorModes::max_modes),
        last_(static_cast<std::size_t>(system.sensor_count())),
        readings_(last_.size()) {}

  [[nodiscard]] std::size_t capacity() const noexcept { return used_.size(); }

  /// Plans the step from `from` over `count` ≤ capacity measurements, in order of validity, to
  /// `to`. `last`: of every sensor before the step. A measurement that no transition leads to is
  /// left out (see `status`); only the estimate's own is needed for the step.
  [[nodiscard]] Status make(const FaultSystem& system, const Measurement* measurements,
                            std::size_t count, Time from, Time to,
                            const std::vector<LastValue>& last) noexcept {
    measurements_ = measurements;
    count_ = 0;
    std::copy(last.begin(), last.end(), last_.begin());
    std::fill(log_density_.begin(), log_density_.end(), 0.0);
    std::fill(readings_.begin(), readings_.end(), 0);
    for (std::size_t i = 0; i < count; ++i) {
      status_[i] = lead(system, from, measurements[i].valid, legs_[count_]);
      if (status_[i] != Status::ok) continue;
      from = measurements[i].valid;
      used_[count_++] = i;
      add_densities(system, measurements[i]);
    }
    return lead(system, from, to, legs_[count_]);
  }

  /// Of the i-th measurement given to `make`: ok, or why it is not used.
  [[nodiscard]] Status status(std::size_t i) const noexcept { return status_[i]; }
  /// How many measurements are used.
  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] const Measurement& measurement(std::size_t i) const noexcept {
    return measurements_[used_[i]];
  }
  /// The leg that ends at used measurement i, or, for i = count, at the estimate.
  [[nodiscard]] const Leg& leg(std::size_t i) const noexcept { return legs_[i]; }
  /// Of all measurements of `sensor` if it is in `mode`; where the rows are not removed, the
  /// constant −½ log 2π of each, and the rest comes from the innovations.
  [[nodiscard]] double log_density(int sensor, int mode) const noexcept {
    return log_density_[static_cast<std::size_t>(sensor * SensorModes::max_modes + mode)];
  }
  /// Number of measurements of `sensor`.
  [[nodiscard]] std::int32_t readings(int sensor) const noexcept {
    return readings_[static_cast<std::size_t>(sensor)];
  }
  /// The last value of every sensor after the step.
  [[nodiscard]] const std::vector<LastValue>& last() const noexcept { return last_; }

 private:
  static Status lead(const FaultSystem& system, Time from, Time to, Leg& leg) noexcept {
    leg.elapsed = to - from;
    return to == from ? Status::ok : system.base().transition(to - from, leg.transition);
  }

  void add_densities(const FaultSystem& system, const Measurement& m) noexcept {
    constexpr double half_log_2pi = 0.91893853320467274178;
    const SensorModes& modes = system.modes(m.sensor);
    const double sigma = m.factor * system.base().sensor(m.sensor).sigma;
    LastValue& last = last_[static_cast<std::size_t>(m.sensor)];
    for (int mode = 0; mode < modes.count(); ++mode) {
      const FaultMode& fault = modes[mode];
      double log_density = -half_log_2pi;
      if (fault.kind == FaultKind::outage) log_density = -std::log(fault.span);
      if (fault.kind == FaultKind::interrupted) {
        const double deviation = std::sqrt(fault.factor) * sigma, normalised = m.value / deviation;
        log_density = -half_log_2pi - std::log(deviation) - 0.5 * normalised * normalised;
      }
      if (fault.kind == FaultKind::frozen) {
        const bool repeats = last.known && std::abs(m.value - last.value) <= 0.5 * fault.resolution;
        log_density = repeats ? std::log1p(-fault.change) - std::log(fault.resolution)
                              : std::log(fault.change) - std::log(fault.span);
      }
      log_density_[static_cast<std::size_t>(m.sensor * SensorModes::max_modes + mode)] +=
          log_density;
    }
    last = {m.value, true};
    ++readings_[static_cast<std::size_t>(m.sensor)];
  }

  const Measurement* measurements_ = nullptr;
  std::size_t count_ = 0;
  std::vector<Leg> legs_;
  std::vector<std::size_t> used_;
  std::vector<Status> status_;
  std::vector<double> log_density_;  // (sensors, max_modes)
  std::vector<LastValue> last_;
  std::vector<std::int32_t> readings_;  // of every sensor
};

}  // namespace surefix::robust
