// What can be wrong with a sensor, as a change of its part of the composite step (Bilenne 2004,
// section 3, and beyond it). A hypothesis gives every sensor one of its modes:
//
//   mode         changes                       log-density of the sensor's measurements
//   healthy      nothing                       part of γ
//   outage       rows removed                  −log(span) each
//   noisy        Υ_s ← C Υ_s                   part of γ
//   interrupted  rows removed                  log N(z; 0, C Υ_s) each
//   frozen       rows removed                  log((1 − ε)/q) where the value repeats the last one
//                                              within q/2, log(ε/span) where it does not
//   drifting     a bias state, b₀² + b_q² τ,   part of γ
//                Υ_s ← C Υ_s
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "surefix/core/status.hpp"

namespace surefix::robust {

enum class FaultKind : std::uint8_t { healthy, outage, noisy, interrupted, frozen, drifting };

/// One mode of one sensor. Only the parameters of its kind are read.
struct FaultMode {
  FaultKind kind = FaultKind::healthy;
  double span = 0.0;    ///< outage, frozen: width of the uniform density [unit of z]
  double factor = 1.0;  ///< noisy, interrupted, drifting: C, the variance in units of the sensor's
  double resolution = 0.0;  ///< frozen: q, step of the sensor's output [unit of z]
  double change = 0.0;      ///< frozen: ε, probability that a frozen value changes all the same
  double sigma = 0.0;       ///< drifting: b₀, of the bias when the fault begins [unit of z]
  double walk = 0.0;        ///< drifting: b_q, root density of its random walk [unit of z / √s]

  double probability = 0.0;  ///< of the mode in any one step, for a constant prior
  double rate = 0.0;         ///< 1/mean time from healthy to this mode [1/s], for a chain
  double duration = 0.0;     ///< mean time until it is healthy again [s], for a chain

  /// Whether the sensor's measurements say nothing about the state.
  [[nodiscard]] bool removes_rows() const noexcept {
    return kind == FaultKind::outage || kind == FaultKind::interrupted || kind == FaultKind::frozen;
  }

  /// Whether the noise variance of measurements that stay is C times the healthy one.
  [[nodiscard]] bool changes_noise() const noexcept {
    return kind == FaultKind::noisy || kind == FaultKind::drifting;
  }

  [[nodiscard]] ConfigStatus check() const noexcept {
    for (const double value :
         {span, factor, resolution, change, sigma, walk, probability, rate, duration}) {
      if (!std::isfinite(value)) return ConfigStatus::not_finite;
      if (value < 0.0) return ConfigStatus::negative;
    }
    const bool uniform = kind == FaultKind::outage || kind == FaultKind::frozen;
    if (uniform && !(span > 0.0)) return ConfigStatus::not_positive;
    if (kind == FaultKind::frozen && !(resolution > 0.0 && change > 0.0 && change < 1.0))
      return ConfigStatus::not_positive;
    return factor > 0.0 ? ConfigStatus::ok : ConfigStatus::not_positive;
  }
};

/// The modes of one sensor; the first is always healthy.
class SensorModes {
 public:
  static constexpr int max_modes = 6;

  [[nodiscard]] ConfigStatus add(const FaultMode& mode) noexcept {
    const ConfigStatus status = mode.check();
    if (status != ConfigStatus::ok) return status;
    if (count_ == max_modes) return ConfigStatus::too_many_modes;
    if (mode.kind == FaultKind::drifting && drifting() >= 0) return ConfigStatus::too_many_modes;
    modes_[static_cast<std::size_t>(count_++)] = mode;
    return ConfigStatus::ok;
  }
  [[nodiscard]] int count() const noexcept { return count_; }
  [[nodiscard]] const FaultMode& operator[](int mode) const noexcept {
    return modes_[static_cast<std::size_t>(mode)];
  }
  /// Index of the drifting mode, −1 if there is none.
  [[nodiscard]] int drifting() const noexcept {
    for (int m = 1; m < count_; ++m)
      if (modes_[static_cast<std::size_t>(m)].kind == FaultKind::drifting) return m;
    return -1;
  }

 private:
  std::array<FaultMode, max_modes> modes_{};
  int count_ = 1;
};

}  // namespace surefix::robust
