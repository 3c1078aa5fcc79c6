// One step of the one-step near-optimal filter (Sigalov & Oshman, section III) and of the IMM
// (section IV), with plain densities: of many series at once, each in its lane.
#pragma once

#include <cstdint>

#include "surefix/switching/step_parts.hpp"

namespace surefix::switching {

/// The exponent of a density below which a unit in its last place is more than one, 1e8 σ from what
/// a mode expects: the differences that tell modes apart may be lost. `take_step_in_logs` looks
/// whether they are.
inline constexpr double least_told = -0x1p53;

/// The signs that a plain step may not hold, lane by lane.
template <class Lane>
struct Signs {
  Lane lowest;           // exponent
  Lane fall;             // the lowest exponent less the greatest
  Lane least_prior;      // of the modes that may be entered
  Lane least_posterior;  // the same after the measurement
  Lane total;            // density of the measurement, less the greatest exponent
  Lane estimate;         // Σ x + Σ P_ii, finite as long as they are

  [[nodiscard]] SUREFIX_INLINE bool good() const noexcept {
    return finite(fall) && finite(estimate) && least(fall) >= deepest &&
           least(lowest) >= least_told && least(least_prior) >= smallest_plain &&
           least(least_posterior) >= smallest_posterior && within(total, smallest, largest);
  }
  [[nodiscard]] bool good(int lane) const noexcept {
    using L = Lanes<Lane>;
    return L::get(fall, lane) >= deepest && L::get(lowest, lane) >= least_told &&
           finite(L::get(estimate, lane)) && L::get(least_prior, lane) >= smallest_plain &&
           L::get(least_posterior, lane) >= smallest_posterior && L::get(total, lane) >= smallest &&
           L::get(total, lane) <= largest;
  }
  /// The lanes, as bits, that have to take their step in logarithms.
  [[nodiscard]] SUREFIX_INLINE std::uint32_t bad() const noexcept {
    if (good()) return 0;
    std::uint32_t bits = 0;
    for (int i = 0; i < Lanes<Lane>::count; ++i)
      if (!good(i)) bits |= std::uint32_t{1} << i;
    return bits;
  }

 private:
  static constexpr double deepest = -300.0, smallest = 1e-200, largest = 1e200;
  static constexpr double smallest_posterior = 1e-290;
};

/// A step with measurements z, none missing. Returns the lanes in which it does not hold.
template <Method method, class S, class O, class Lane>
SUREFIX_INLINE std::uint32_t take_step(const Step<S>& step,
                                       const Observation<O>* const* observation,
                                       const ModeTable<S>& modes, const Measured<O, Lane>& z,
                                       const State<S, Lane>& from, State<S, Lane>& to,
                                       Workspace<S, Lane>& room) noexcept {
  const int M = modes.size();
  predict_modes<method, false>(step, from, to, room, M);
  Likelihood<S, Lane>& found = room.likelihood;
  if (!read_all<false>(step, observation, modes, z, to, found)) return ~std::uint32_t{0};

  Lane shift = found.exponent[0], lowest = found.exponent[0];
  Lane least_prior = Lanes<Lane>::all(1.0);
  loop<S::M>(M, [&](int j) SUREFIX_LAMBDA {
    shift = greater(shift, found.exponent[at(j)]);
    lowest = smaller(lowest, found.exponent[at(j)]);
    const Lane prior = room.before.prior[at(j)] + modes.impossible(j);
    least_prior = smaller(least_prior, prior);
  });
  loop<S::M>(M, [&](int j) SUREFIX_LAMBDA {
    const Lane relative = found.exponent[at(j)] - shift;
    to.law.mode[at(j)] = room.before.prior[at(j)] * (found.factor[at(j)] * exponential(relative));
  });
  if (modes.any_lumped())
    for (int j = 0; j < M; ++j)
      if (modes.lumped(j))
        to.law.mode[at(j)] =
            room.before.prior[at(j)] *
            lumped_density(modes, j, *observation[step.system(j)], found.noise[at(j)], shift);
  const Lane total = sum_of<S::M, Lane>(  // (8)
      M, [&](int j) SUREFIX_LAMBDA -> const Lane& { return to.law.mode[at(j)]; });
  const Lane inverse = 1.0 / total;
  loop<S::M>(M, [&](int j) SUREFIX_LAMBDA { to.law.mode[at(j)] *= inverse; });
  to.law.deep = Lanes<Lane>::all(0.0);
  merge(step, to, M);

  to.evidence.follow(from.evidence, total, shift, static_cast<int>(z.size()));
  Lane least_posterior = Lanes<Lane>::all(1.0);
  if constexpr (S::m != 1)  // δ^{-m/2} of many components may be below all else
    for (int j = 0; j < M; ++j) {
      const Lane posterior = to.law.mode[at(j)] + modes.impossible(j);
      least_posterior = smaller(least_posterior, posterior);
    }
  const Lane estimate = sum_of<S::n, Lane>(to.merged.size(), [&](int i) SUREFIX_LAMBDA {
    return Lane(to.merged.x(i) + to.merged.P(i, i));
  });
  const Lane fall = lowest - shift;
  return Signs<Lane>{lowest, fall, least_prior, least_posterior, total, estimate}.bad();
}

}  // namespace surefix::switching
