// What a measurement says of each mode: its log-density, and what it does to the mode's estimate.
#pragma once

#include <cmath>

#include "surefix/core/exponential.hpp"
#include "surefix/core/observation.hpp"
#include "surefix/core/update.hpp"
#include "surefix/switching/mode_table.hpp"

namespace surefix::switching {

/// Of every mode: density = factor · e^exponent, but for (2π)^{-m/2}; of a lumped one the exponent
/// of its greatest δ.
template <class S, class Lane>
struct Likelihood {
  Bank<Lane, S::M> exponent{};
  Bank<Lane, S::M> factor{};
  Bank<Lane, S::M> noise{};  // zᵀR⁻¹z, of modes with γ = 0
};

/// Updates a belief by z (whitened) in a mode with γ ≠ 0: Kalman's update with γ H and δ R; the
/// mode's density of z is N(z; γ H x, γ² H P Hᵀ + δ R), with P and x predicted (the paper's (9)
/// has P_k).
///
/// `factor` is Π S^{-1/2}, its logarithm if `in_logs`. False if an innovation's variance is not
/// positive.
template <bool in_logs, class G, class O, class Z, class Lane>
[[nodiscard]] SUREFIX_INLINE bool read(G& belief, const Observation<O>& observation, const Z& z,
                                       double gamma, double delta, Lane& exponent,
                                       Lane& factor) noexcept {
  exponent = Lanes<Lane>::all(0.0);
  factor = Lanes<Lane>::all(in_logs ? 0.0 : 1.0);
  bool good = true;
  loop<O::m>(observation.size(), [&](int i) SUREFIX_LAMBDA {
    if (!good) return;
    const auto h = observation.row(i, gamma);
    const DenseRow<std::decay_t<decltype(h)>> row{h};
    const Lane innovation = z(i) - row.dot(belief.x);
    Innovation<G> brought;
    good = update(belief, row, observation.variance(i) * delta, innovation, brought);
    if (!good) return;
    exponent -= (0.5 * innovation) * (innovation * brought.inverse);
    if constexpr (in_logs) {
      factor += 0.5 * std::log(brought.inverse);
    } else {
      factor *= square_root(brought.inverse);
    }
  });
  return good;
}

/// zᵀR⁻¹z of a whitened z.
template <class O, class Z, class Lane>
SUREFIX_INLINE void square_of_noise(const Observation<O>& observation, const Z& z,
                                    Lane& out) noexcept {
  out = Lanes<Lane>::all(0.0);
  loop<O::m>(observation.size(),
             [&](int i) SUREFIX_LAMBDA { out += z(i) * (z(i) * observation.precision(i)); });
}

/// Density of the noise alone, z ~ N(0, δ R), mixed over a lumped mode's branches, relative to
/// e^shift.
template <class S, class O, class Lane>
[[nodiscard]] SUREFIX_INLINE Lane lumped_density(const ModeTable<S>& modes, int mode,
                                                 const Observation<O>& observation,
                                                 const Lane& squares, const Lane& shift) noexcept {
  Lane sum = Lanes<Lane>::all(0.0);
  for (int b = modes.first(mode); b < modes.end(mode); ++b) {
    const Lane exponent = squares * (-0.5 / modes.branch(b).delta) - shift;
    const double factor = modes.factor(b, observation.size()) * observation.density();
    sum += factor * exponential(exponent);
  }
  return sum;
}

/// The logarithm of the density of the noise alone, for one series whose measurement has the
/// precisions of `observation`.
template <class S, class O>
[[nodiscard]] double log_density_of_noise(const ModeTable<S>& modes, int mode, double squares,
                                          const Observation<O>& observation) noexcept {
  double log_det = 0.0, most = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (int i = 0; i < observation.size(); ++i) log_det += std::log(observation.variance(i));
  const auto log_value = [&](int b) {
    const auto& branch = modes.branch(b);
    return std::log(branch.share) -
           0.5 * (squares / branch.delta + log_det + observation.size() * std::log(branch.delta));
  };
  for (int b = modes.first(mode); b < modes.end(mode); ++b) most = greater(log_value(b), most);
  for (int b = modes.first(mode); b < modes.end(mode); ++b) sum += std::exp(log_value(b) - most);
  return most + std::log(sum);
}

}  // namespace surefix::switching
