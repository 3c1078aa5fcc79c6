// A system whose sensors may be faulty. Its state is the system's, then the bias of every sensor
// that can drift:  [ system states | bias of the first drifting sensor, … ].
//
// All hypotheses share this state and the rows of H. Where a sensor does not drift its bias is
// zero with variance zero, so it adds nothing; where a sensor's rows are removed the variance of
// its noise is so large that the update changes nothing. That is why hypotheses go through the
// same instructions side by side.
#pragma once

#include "surefix/core/system.hpp"
#include "surefix/robust/mode_table.hpp"

namespace surefix::robust {

/// Noise variance that stands for a removed row: a gain of 1e-60 P, times an innovation of at most
/// 1e30, changes nothing. (Larger figures would: products of such gains are denormal numbers, which
/// cost a hundred times a normal one.)
inline constexpr double removed_variance = 1e60;
inline constexpr double largest_value = 1e30;

/// `Drifts`: how many sensors can drift, or Eigen::Dynamic with at most `MaxDrifts`.
template <class System, int Drifts, int MaxDrifts = Drifts>
class FaultSystem {
  static constexpr bool dynamic = System::size == Eigen::Dynamic || Drifts == Eigen::Dynamic;

 public:
  using Base = System;
  static constexpr int size = dynamic ? Eigen::Dynamic : System::size + Drifts;
  static constexpr int max_size = System::max_size + MaxDrifts;
  using Transition = typename System::Transition;

  /// `modes`: of every sensor of `system`, in its order.
  [[nodiscard]] ConfigStatus make(const std::vector<SensorModes>& modes) {
    if (static_cast<int>(modes.size()) != system_.sensor_count()) return ConfigStatus::wrong_size;
    modes_ = modes;
    drift_state_.assign(modes.size(), -1);
    drifts_ = 0;
    for (std::size_t s = 0; s < modes.size(); ++s)
      if (modes[s].drifting() >= 0) {
        if (drifts_ == MaxDrifts) return ConfigStatus::sensor_states;
        drift_state_[s] = system_.state_size() + drifts_++;
      }
    for (int s = 0; s < sensor_count(); ++s)
      for (int m = 0; m < modes_[static_cast<std::size_t>(s)].count(); ++m)
        if (!modes_[static_cast<std::size_t>(s)][m].removes_rows() &&
            !(variance(s, m) < 1e-3 * removed_variance))
          return ConfigStatus::not_finite;  // it could not be told from a removed row
    const bool complete = Drifts == Eigen::Dynamic || drifts_ == Drifts;
    return complete ? ConfigStatus::ok : ConfigStatus::sensor_states;
  }
  explicit FaultSystem(const System& system) : system_(system) {}

  [[nodiscard]] const System& base() const noexcept { return system_; }
  [[nodiscard]] int base_size() const noexcept { return system_.state_size(); }
  [[nodiscard]] int state_size() const noexcept { return base_size() + drifts_; }
  [[nodiscard]] int sensor_count() const noexcept { return system_.sensor_count(); }
  [[nodiscard]] const std::vector<SensorModes>& modes() const noexcept { return modes_; }
  [[nodiscard]] const SensorModes& modes(int sensor) const noexcept {
    return modes_[static_cast<std::size_t>(sensor)];
  }
  /// Index of the bias of a drifting sensor, −1 if it cannot drift.
  [[nodiscard]] int drift_state(int sensor) const noexcept {
    return drift_state_[static_cast<std::size_t>(sensor)];
  }

  /// Variance of a measurement of `sensor` in mode `mode`.
  [[nodiscard]] double variance(int sensor, int mode) const noexcept {
    const FaultMode& fault = modes(sensor)[mode];
    if (fault.removes_rows()) return removed_variance;
    const double sigma = system_.sensor(sensor).sigma;
    return fault.changes_noise() ? fault.factor * sigma * sigma : sigma * sigma;
  }

  /// What a sensor should read, bias included, and where that is linearised.
  template <class Vector>
  [[nodiscard]] SUREFIX_INLINE auto read(int sensor, const Vector& x) const noexcept {
    auto reading = system_.read(sensor, x);
    if (drift_state(sensor) >= 0) reading.predicted += x(drift_state(sensor));
    return reading;
  }

  /// Calls `visit(row)` with the sensor's row.
  template <class Lane, class Visit>
  SUREFIX_INLINE auto with_row(int sensor, const BasicLinearisation<Lane>& at,
                               Visit&& visit) const noexcept {
    auto row = system_.template row<1>(sensor, at);
    if (drift_state(sensor) >= 0) row.add(drift_state(sensor), Lane(1.0));
    return visit(row);
  }

 private:
  System system_;
  std::vector<SensorModes> modes_;
  std::vector<int> drift_state_;
  int drifts_ = 0;
};

}  // namespace surefix::robust
