// A motion model and the sensors that watch it, with one state vector for both:
//   [ model states | scale of sensor 0, bias of sensor 0, scale of sensor 1, … ]
// A scale or bias state exists only where the sensor's sigma for it is above zero, so the user
// lists sensors and never builds a matrix.
#pragma once

#include <array>

#include "surefix/core/row.hpp"
#include "surefix/core/sensor.hpp"
#include "surefix/core/system_transition.hpp"

namespace surefix {

/// Where a sensor's reading ẑ = (1 + ŝ) h x̂ + b̂ was linearised: its gain 1 + ŝ and level h x̂.
template <class Lane>
struct BasicLinearisation {
  Lane gain;
  Lane level;
};
using Linearisation = BasicLinearisation<double>;

/// The predicted reading ẑ, and where it is linearised.
template <class Lane>
struct BasicReading {
  BasicLinearisation<Lane> at;
  Lane predicted;
};
using Reading = BasicReading<double>;

/// `SensorStates`: how many scale and bias states the sensors have together, or Eigen::Dynamic
/// with at most `MaxSensorStates`.
template <class Model, int SensorStates = 0, int MaxSensorStates = SensorStates, int MaxSensors = 8>
class System {
  static constexpr bool dynamic = Model::size == Eigen::Dynamic || SensorStates == Eigen::Dynamic;

 public:
  static constexpr int size = dynamic ? Eigen::Dynamic : Model::size + SensorStates;
  static constexpr int max_size = Model::max_size + MaxSensorStates;
  using Belief = Gaussian<size, double, max_size>;
  using ModelBelief = Gaussian<Model::size, double, Model::max_size>;
  using SensorType = Sensor<typename ModelBelief::Vector>;
  using Transition = SystemTransition<typename Model::Transition, SensorStates, MaxSensorStates>;

  explicit System(const Model& model) noexcept : model_(model) {}

  /// Adds a sensor; its index is the number of sensors before it. On failure nothing is added.
  [[nodiscard]] ConfigStatus add(const SensorType& sensor) noexcept {
    if (sensor.observes.size() != model_size()) return ConfigStatus::wrong_size;
    const ConfigStatus status = sensor.check();
    if (status != ConfigStatus::ok) return status;
    if (sensor_count_ == MaxSensors) return ConfigStatus::too_many_sensors;
    Watcher watcher{sensor};
    const int wanted = (sensor.scale.present() ? 1 : 0) + (sensor.bias.present() ? 1 : 0);
    if (sensor_states_ + wanted > MaxSensorStates) return ConfigStatus::sensor_states;
    if (sensor.scale.present()) watcher.scale_state = append(sensor.scale);
    if (sensor.bias.present()) watcher.bias_state = append(sensor.bias);
    watcher.plain = wanted == 0 && reads_output_only(sensor);
    watchers_[static_cast<std::size_t>(sensor_count_++)] = watcher;
    return ConfigStatus::ok;
  }

  /// Whether the model is one, and the sensors added so far fill the state vector; to be asked
  /// once, before the start.
  [[nodiscard]] ConfigStatus check() const noexcept {
    const bool complete = SensorStates == Eigen::Dynamic || sensor_states_ == SensorStates;
    return complete ? model_.check() : ConfigStatus::sensor_states;
  }

  [[nodiscard]] const Model& model() const noexcept { return model_; }
  [[nodiscard]] int model_size() const noexcept { return model_.state_size(); }
  [[nodiscard]] int state_size() const noexcept {
    if constexpr (size != Eigen::Dynamic) return size;
    return model_size() + sensor_states_;
  }
  [[nodiscard]] int sensor_count() const noexcept { return sensor_count_; }
  [[nodiscard]] const SensorType& sensor(int index) const noexcept { return watcher(index).sensor; }
  /// Index of a sensor's scale or bias in the state, −1 where it has none.
  [[nodiscard]] int scale_state(int index) const noexcept { return watcher(index).scale_state; }
  [[nodiscard]] int bias_state(int index) const noexcept { return watcher(index).bias_state; }

  /// The model's belief with the sensor states in their stationary distribution.
  [[nodiscard]] Belief initial(const ModelBelief& model) const noexcept {
    const int n = state_size(), m = model_size();
    Belief belief{Belief::Vector::Zero(n), Belief::Matrix::Zero(n, n)};
    for (int j = 0; j < m; ++j) {
      belief.x(j) = model.x(j);
      for (int i = 0; i < m; ++i) belief.P(i, j) = model.P(i, j);
    }
    for (int s = m; s < n; ++s) belief.P(s, s) = error(s).sigma * error(s).sigma;
    return belief;
  }

  [[nodiscard]] SUREFIX_INLINE Status transition(Time elapsed, Transition& out) const noexcept {
    if constexpr (SensorStates != 0) {
      const double dt = seconds(elapsed);
      out.model_size = model_size();
      out.decay.resize(sensor_states_);
      out.noise.resize(sensor_states_);
      for (int s = 0; s < sensor_states_; ++s) {
        out.decay(s) = error(model_size() + s).decay(dt);
        out.noise(s) = error(model_size() + s).noise(dt);
      }
    }
    return model_.transition(elapsed, out.model);
  }

  /// What the sensor should read at state x, and where that is linearised.
  template <class Vector>
  [[nodiscard]] SUREFIX_INLINE BasicReading<typename Vector::Scalar> read(
      int index, const Vector& x) const noexcept {
    using Lane = typename Vector::Scalar;
    const Watcher& w = watcher(index);
    if constexpr (Model::output >= 0)
      if (w.plain) return {{Lane(1.0), Lane(0.0)}, x(Model::output)};
    const Vector apart = x;  // see `with_row`
    Lane level = Lane(0.0);
    for (int i = 0; i < model_size(); ++i) level += w.sensor.observes(i) * apart(i);
    Lane gain = Lane(1.0), bias = Lane(0.0);
    if (w.scale_state >= 0) gain += apart(w.scale_state);
    if (w.bias_state >= 0) bias = apart(w.bias_state);
    return {{gain, level}, gain * level + bias};
  }

  /// The sensor's row ∂ẑ/∂x, put together at run time, with room for `More` entries of others.
  template <int More = 0, class Lane>
  [[nodiscard]] SUREFIX_INLINE SparseRow<Model::max_size + 2 + More, Lane> row(
      int index, const BasicLinearisation<Lane>& at) const noexcept {
    const Watcher& w = watcher(index);
    SparseRow<Model::max_size + 2 + More, Lane> row;
    for (int i = 0; i < model_size(); ++i)
      if (w.sensor.observes(i) != 0.0) row.add(i, at.gain * w.sensor.observes(i));
    if (w.scale_state >= 0) row.add(w.scale_state, at.level);
    if (w.bias_state >= 0) row.add(w.bias_state, Lane(1.0));
    return row;
  }

  /// Calls `visit(row, value)` with the sensor's row ∂ẑ/∂x and returns what it returns. Rows that
  /// are put together at run time work on a copy of `value`: one index that is not a constant
  /// would force a small belief out of the registers on every path.
  template <class Lane, class Value, class Visit>
  SUREFIX_INLINE auto with_row(int index, const BasicLinearisation<Lane>& at, Value& value,
                               Visit&& visit) const noexcept {
    const Watcher& w = watcher(index);
    if constexpr (Model::output >= 0)
      if (w.plain) return visit(ComponentRow<Model::output>{}, value);
    if constexpr (dynamic) {
      return visit(row(index, at), value);
    } else {
      Value apart = value;
      const auto result = visit(row(index, at), apart);
      assign(value, apart);
      return result;
    }
  }

 private:
  struct Watcher {
    SensorType sensor{};
    int scale_state = -1;
    int bias_state = -1;
    bool plain = false;  // reads the model's output alone, without errors of its own
  };

  [[nodiscard]] const Watcher& watcher(int index) const noexcept {
    return watchers_[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] const GaussMarkov& error(int state) const noexcept {
    return errors_[static_cast<std::size_t>(state - model_size())];
  }
  int append(const GaussMarkov& error) noexcept {
    errors_[static_cast<std::size_t>(sensor_states_)] = error;
    return model_size() + sensor_states_++;
  }
  [[nodiscard]] bool reads_output_only(const SensorType& sensor) const noexcept {
    if (Model::output < 0) return false;
    for (int i = 0; i < model_size(); ++i)
      if (sensor.observes(i) != (i == Model::output ? 1.0 : 0.0)) return false;
    return true;
  }

  Model model_;
  int sensor_count_ = 0;
  int sensor_states_ = 0;
  std::array<Watcher, MaxSensors> watchers_{};
  std::array<GaussMarkov, MaxSensorStates + 1> errors_{};  // + 1: an array may not be empty
};

}  // namespace surefix
