// A sensor as it is: white noise, a constant latency, a scale factor that is not quite one, a bias
// that wanders.
//
//   z(t + latency) = (1 + s) h x(t) + b + v
//
// with white v, and s and b first-order Gauss–Markov processes: stationary standard deviation σ
// and time constant τ, so that over Δt they keep φ = e^{−Δt/τ} of their value and gain the
// variance σ² (1 − φ²). τ = ∞ is a constant that is only known to be N(0, σ²).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "surefix/core/status.hpp"
#include "surefix/core/time.hpp"

namespace surefix {

/// A first-order Gauss–Markov error; absent when sigma is 0.
struct GaussMarkov {
  double sigma = 0.0;                                     ///< stationary standard deviation
  double time = std::numeric_limits<double>::infinity();  ///< time constant τ [s]

  [[nodiscard]] bool present() const noexcept { return sigma > 0.0; }
  [[nodiscard]] double decay(double dt) const noexcept { return std::exp(-dt / time); }
  [[nodiscard]] double noise(double dt) const noexcept {
    return sigma * sigma * -std::expm1(-2.0 * dt / time);
  }
  [[nodiscard]] ConfigStatus check() const noexcept {
    if (std::isnan(time) || !std::isfinite(sigma * sigma)) return ConfigStatus::not_finite;
    if (sigma < 0.0) return ConfigStatus::negative;
    return time > 0.0 ? ConfigStatus::ok : ConfigStatus::not_positive;
  }
};

/// One sensor of a model of state vector `Vector` (n).
template <class Vector>
struct Sensor {
  /// h (n): what it reads of the model's state.
  Vector observes = Vector::Zero(std::max<int>(Vector::RowsAtCompileTime, 0));
  double sigma = 0.0;   ///< standard deviation of the white noise; its square > 0 too [unit of z]
  Time latency = 0;     ///< a value belongs to the time of its stamp minus this [ns]
  GaussMarkov scale{};  ///< relative error of the scale factor
  GaussMarkov bias{};   ///< additive error [unit of z]

  [[nodiscard]] ConfigStatus check() const noexcept {
    const double variance = sigma * sigma;  // what the filter computes with
    if (!observes.allFinite() || !std::isfinite(variance)) return ConfigStatus::not_finite;
    if (!(sigma > 0.0 && std::isnormal(variance))) return ConfigStatus::not_positive;
    if (std::abs(seconds(latency)) > max_latency) return ConfigStatus::not_finite;
    const ConfigStatus status = scale.check();
    return status == ConfigStatus::ok ? bias.check() : status;
  }
};

}  // namespace surefix
