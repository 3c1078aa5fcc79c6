// The exact likelihood ratio of a fault for every onset, in one backward sweep.
//
// A fault d of unit amplitude moves the innovations by ρ_i = d_i − h_i b, where b is what it has
// moved the estimate by; with a = (b, s), s the profile's state, both are linear in a. From the end
//   M ← Φᵀ M Φ + cᵀ S⁻¹ c      ℓ ← Φᵀ ℓ + cᵀ S⁻¹ ν
// and a fault that begins at i with s = S₀ a changes the likelihood by
//   𝓛(z) − 𝓛(z − d a) = 2 aᵀ S₀ᵀℓ_s − aᵀ (S₀ᵀ M_ss S₀) a.
// M_bb is the Λ of every backward sweep and ℓ_b is −λ; only the blocks of s are new:
//   M_bs ← (I − kh)ᵀ M_bs + δ (m − D hᵀ) c           m = Λk, D = 1/S + kᵀm
//   M_ss ← M_ss + δ (cᵀ q + qᵀ c) + δ² D cᵀc         q = kᵀM_bs, δ the fault's weight in i
//   ℓ_s  ← ℓ_s + δ cᵀ w                              w = (Γ⁻¹γ)_i
// so that ℓ_s is Σ d_i w_i: half the first-order indicator of Parellier, Barrau & Bonnabel (18).
#pragma once

#include "surefix/drift/information_sweep.hpp"
#include "surefix/drift/signal_sweep.hpp"

namespace surefix::drift {

/// Whether a fault in `direction` can begin at measurement i: it is seen there, and not yet by one
/// before it of the same time.
template <class Record>
[[nodiscard]] bool can_begin(const Record& record, const double* direction,
                             std::size_t i) noexcept {
  if (record.weight(i, direction) == 0.0) return false;
  for (; i > 0 && !(record[i].elapsed > 0.0); --i)
    if (record.weight(i - 1, direction) != 0.0) return false;
  return true;
}

/// Sweeps `parts` (`InformationSweep`, `SignalSweep`, …) together from the last measurement to the
/// first: `take(measurement, i, weight)`, then, where a fault can begin, `visit(i)`, then
/// `move(…)`. False if the profile overflows.
template <class Record, class Take, class Visit, class Move>
[[nodiscard]] SUREFIX_INLINE bool onset_sweep(const Record& record, const Profile& profile,
                                              const double* direction, Take&& take, Visit&& visit,
                                              Move&& move) noexcept {
  ProfileStep step(profile);
  for (std::size_t i = record.size(); i-- > 0;) {
    const auto measurement = record[i];
    const double weight = record.weight(i, direction);
    take(measurement, i, weight);
    if (weight != 0.0 && can_begin(record, direction, i)) visit(i);
    if (i == 0 || !(measurement.elapsed > 0.0)) continue;
    if (!step.over(measurement.elapsed)) return false;
    move(measurement, step.F());
  }
  return true;
}

}  // namespace surefix::drift
