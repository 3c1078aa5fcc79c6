// The estimate of the measurement noise itself (Bilenne 2004, eqs. 22-27): fault detection looks at
// v̂ = Υ Γ⁻¹ γ, not at the innovation, which the process noise corrupts.
#pragma once

#include "surefix/desync/backward_sweep.hpp"

namespace surefix::desync {

/// v̂_i (eq. 25) and its variance (Υ Γ⁻¹ Υ)_ii (eq. 26) of one measurement. With no fault v̂_i is
/// N(0, variance), so v̂_i / √variance is the normalised noise.
struct NoiseEstimate {
  std::int64_t id;  ///< of the measurement
  double value;     ///< v̂ [unit of the sensor]
  double variance;
};

/// Noise of all `count` recorded measurements given all of them: calls `store(i, NoiseEstimate)`.
/// The records of one step give the paper's v̂_k|k, those of a journey eq. 23 for all of it.
template <class System, class Store>
void estimate_noise(const System& system, const Record<System>* records, std::size_t count,
                    Store&& store) noexcept {
  backward_sweep(
      system, records, count, [&](std::size_t i, const Record<System>& record, const Whitened& w) {
        const double sigma = record.factor * system.sensor(record.sensor).sigma;
        const double variance = sigma * sigma;  // Υ_i
        store(i, NoiseEstimate{record.id, variance * w.value, variance * variance * w.precision});
      });
}

}  // namespace surefix::desync
