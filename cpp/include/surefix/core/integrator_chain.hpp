// Constant velocity and constant acceleration: chains of integrators driven by white noise.
//
// A chain of N integrators is ẋ₁ = x₂, …, ẋ_N = τ with white noise τ of root spectral density q:
//   F_ij = Δt^(j−i) / (j−i)!
//   Q_ij = q² Δt^(a+b+1) / (a! b! (a+b+1)),  a = N−i, b = N−j  (i, j counted from 1)
// For N = 2 it is the speed model of Bilenne 2004, eq. 33.
#pragma once

#include <cmath>

#include "surefix/core/loop.hpp"
#include "surefix/core/status.hpp"
#include "surefix/core/time.hpp"

namespace surefix {

/// The transition of a chain over one duration, without the products by its zeros and ones.
template <int N>
class ChainTransition {
 public:
  ChainTransition() = default;
  SUREFIX_INLINE ChainTransition(double dt, double density) noexcept : density_(density) {
    power_[0] = 1.0;
    for (int k = 1; k < N; ++k) power_[k] = power_[k - 1] * (dt / k);
    dt_ = dt;
  }

  template <class V>
  SUREFIX_INLINE void apply(V&& v) const noexcept {
    loop<N>(N, [&](int i) SUREFIX_LAMBDA {
      loop<N>(N, [&](int j) SUREFIX_LAMBDA {
        if (j > i) v(i) += power_[j - i] * v(j);
      });
    });
  }

  template <class V>
  SUREFIX_INLINE void apply_transposed(V&& v) const noexcept {
    loop<N>(N, [&](int last) SUREFIX_LAMBDA {
      const int j = N - 1 - last;
      loop<N>(N, [&](int i) SUREFIX_LAMBDA {
        if (i < j) v(j) += power_[j - i] * v(i);
      });
    });
  }

  template <class M>
  SUREFIX_INLINE void add_noise(M& P) const noexcept {
    const double scale = density_ * dt_;  // q² Δt
    loop<N>(N, [&](int j) SUREFIX_LAMBDA {
      loop<N>(N, [&](int i) SUREFIX_LAMBDA {
        const int a = N - 1 - i, b = N - 1 - j;
        P(i, j) += scale * (power_[a] * power_[b]) * (1.0 / (a + b + 1));
      });
    });
  }

 private:
  double power_[N];  // Δt^k / k!
  double dt_ = 0.0;
  double density_ = 0.0;  // q²
};

/// A chain of N integrators as a motion model. `Output` is the component that a speed sensor
/// reads, counted from 0.
template <int N, int Output>
class IntegratorChain {
 public:
  static constexpr int size = N;
  static constexpr int max_size = N;
  static constexpr int output = Output;
  using Transition = ChainTransition<N>;

  /// `root_density`: q, root spectral density of the driving noise [unit of x_N per √s], ≥ 0.
  explicit IntegratorChain(double root_density) noexcept
      : root_density_(root_density), density_(root_density * root_density) {}

  [[nodiscard]] ConfigStatus check() const noexcept {
    if (!std::isfinite(density_)) return ConfigStatus::not_finite;
    return root_density_ < 0.0 ? ConfigStatus::negative : ConfigStatus::ok;
  }

  [[nodiscard]] static constexpr int state_size() noexcept { return N; }

  /// F and Q over `elapsed` ≥ 0.
  [[nodiscard]] SUREFIX_INLINE Status transition(Time elapsed, Transition& out) const noexcept {
    out = Transition(seconds(elapsed), density_);
    return Status::ok;
  }

 private:
  double root_density_;  // q, whose sign only `check` needs
  double density_;       // q²
};

/// [speed] driven by white acceleration, q in m/s²/√Hz.
using ConstantVelocity = IntegratorChain<1, 0>;
/// [position, speed] driven by white acceleration, q in m/s²/√Hz.
using ConstantVelocityWithPosition = IntegratorChain<2, 1>;
/// [speed, acceleration] driven by white jerk, q in m/s³/√Hz (Bilenne 2004, eq. 33).
using ConstantAcceleration = IntegratorChain<2, 0>;
/// [position, speed, acceleration] driven by white jerk, q in m/s³/√Hz.
using ConstantAccelerationWithPosition = IntegratorChain<3, 1>;

}  // namespace surefix
