// One step of the one-step near-optimal filter (Sigalov & Oshman, section III) and of the IMM
// (section IV): each mode predicts, reads the measurement and says how probable it was; the
// answers are merged. They differ only in what a mode starts from.
#pragma once

#include <cstdint>

#include "surefix/core/predict.hpp"
#include "surefix/core/status.hpp"
#include "surefix/switching/likelihood.hpp"
#include "surefix/switching/method.hpp"
#include "surefix/switching/mixture.hpp"
#include "surefix/switching/state.hpp"
#include "surefix/switching/state_map.hpp"

namespace surefix::switching {

/// How state and mode have moved since the step before, with one system or one for every mode. The
/// first step has no transitions.
template <class S>
struct Step {
  const Transition<S>* const* transition;  // (systems), null in the first step
  const double* p;                         // (M × M) transitions of the modes, rows before
  bool per_mode;                           // a system for every mode
  const StateMap* map;                     // of systems with different states, else null

  [[nodiscard]] int system(int mode) const noexcept { return per_mode ? mode : 0; }
};

/// Room that a step works in.
template <class S, class Lane>
struct Workspace {
  ModePrior<S, Lane> before;
  Likelihood<S, Lane> likelihood;

  void make(int M) {
    resize(before.prior, M);
    resize(before.log_prior, M);
    resize(before.share, M * M);
    resize(likelihood.exponent, M);
    resize(likelihood.factor, M);
    resize(likelihood.noise, M);
  }
};

/// The modes' beliefs and probabilities before the measurement; `from` and `to` are two states.
template <Method method, bool in_logs, class S, class Lane>
SUREFIX_INLINE void predict_modes(const Step<S>& step, const State<S, Lane>& from,
                                  State<S, Lane>& to, Workspace<S, Lane>& room, int M) noexcept {
  if (step.transition == nullptr) {
    loop<S::M>(M, [&](int j) SUREFIX_LAMBDA {
      assign(to.bank[at(j)], from.bank[at(j)]);
      room.before.prior[at(j)] = from.law.mode[at(j)];
      if constexpr (in_logs) room.before.log_prior[at(j)] = log_mode(from.law, j);
    });
    return;
  }
  if constexpr (in_logs) {
    predict_in_logs(from.law, step.p, M, room.before);
  } else {
    predict(from.law, step.p, M, room.before);
  }
  loop<S::M>(M, [&](int j) SUREFIX_LAMBDA {
    auto& belief = to.bank[at(j)];
    if constexpr (method == Method::one_step) {
      if (j == 0) {
        assign(belief, from.merged);
        predict(belief, *step.transition[0]);
      } else {
        assign(belief, to.bank[0]);
      }
    } else {
      const auto share = [&](int i) SUREFIX_LAMBDA -> const Lane& {
        return room.before.share[at(i * M + j)];
      };
      if (S::n == Eigen::Dynamic && step.map != nullptr) {
        using From = std::decay_t<decltype(from.bank)>;
        mix<S::M>(MappedStates<From, Lane>{from.bank, *step.map, step.map->states[at(j)]}, M, share,
                  belief);
      } else {
        mix<S::M>(SameStates<std::decay_t<decltype(from.bank)>>{from.bank}, M, share, belief);
      }
      predict(belief, *step.transition[step.system(j)]);
    }
  });
}

/// The estimate of all modes together.
template <class S, class Lane>
SUREFIX_INLINE void merge(const Step<S>& step, State<S, Lane>& to, int M) noexcept {
  using From = std::decay_t<decltype(to.bank)>;
  const auto weight = [&](int j) SUREFIX_LAMBDA -> const Lane& { return to.law.mode[at(j)]; };
  if (S::n == Eigen::Dynamic && step.map != nullptr) {
    mix<S::M>(MappedStates<From, Lane>{to.bank, *step.map, step.map->all}, M, weight, to.merged);
  } else {
    mix<S::M>(SameStates<From>{to.bank}, M, weight, to.merged);
  }
}

/// The log-density below which a unit in the last place is more than one, 1e8 σ from what a mode
/// expects: of exponents beyond it the difference, which tells modes apart, is lost. A measurement
/// that leaves several modes so is refused: the spread of their means would be beyond what one
/// covariance holds beside their own.
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

/// What every mode makes of z: its belief, and the exponent and factor of its density (of γ = 0
/// the exponent alone). False if an innovation's variance is not positive.
template <bool in_logs, class S, class O, class Lane>
[[nodiscard]] SUREFIX_INLINE bool read_all(const Step<S>& step,
                                           const Observation<O>* const* observation,
                                           const ModeTable<S>& modes, const Measured<O, Lane>& z,
                                           State<S, Lane>& to, Likelihood<S, Lane>& out) noexcept {
  Measured<O, Lane> white = z;
  observation[0]->whiten(white);
  bool good = true;
  loop<S::M>(modes.size(), [&](int j) SUREFIX_LAMBDA {
    const Observation<O>& own = *observation[step.system(j)];
    if (step.per_mode && j > 0) {
      white = z;
      own.whiten(white);
    }
    if (!modes.reads(j)) {
      square_of_noise(own, white, out.noise[at(j)]);
      out.exponent[at(j)] = out.noise[at(j)] * modes.fall(j);
      const double density = modes.factor(modes.first(j), own.size()) * own.density();
      out.factor[at(j)] = Lanes<Lane>::all(density);
    } else {
      good &= read<in_logs>(to.bank[at(j)], own, white, modes.gamma(j), modes.delta(j),
                            out.exponent[at(j)], out.factor[at(j)]);
    }
  });
  return good;
}

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

/// The same in logarithms, for one series. False if an innovation's variance is not positive or no
/// mode has a density, or several have one below `least_told`.
template <Method method, class S, class O>
[[nodiscard]] bool take_step_in_logs(const Step<S>& step, const Observation<O>* const* observation,
                                     const ModeTable<S>& modes, const Measured<O>& z,
                                     const State<S, double>& from, State<S, double>& to,
                                     Workspace<S, double>& room) noexcept {
  const int M = modes.size();
  predict_modes<method, true>(step, from, to, room, M);
  Likelihood<S, double>& found = room.likelihood;
  if (!read_all<true>(step, observation, modes, z, to, found)) return false;
  double best = -std::numeric_limits<double>::infinity();
  for (int j = 0; j < M; ++j) {
    const double log_density = !modes.reads(j) ? log_density_of_noise(modes, j, found.noise[at(j)],
                                                                      *observation[step.system(j)])
                                               : found.exponent[at(j)] + found.factor[at(j)];
    to.law.log_mode[at(j)] = room.before.log_prior[at(j)] + log_density;
    best = greater(to.law.log_mode[at(j)], best);
  }
  if (!finite(best)) return false;
  // The greatest first: beside it the logarithm of the sum of the others would be lost.
  for (int j = 0; j < M; ++j) to.law.log_mode[at(j)] -= best;
  const double rest = log_sum(to.law.log_mode, M);
  if (!finite(rest)) return false;
  if (best < least_told && rest > 0.0) return false;
  to.law.deep = 0.0;
  for (int j = 0; j < M; ++j) {
    double& log_mode = to.law.log_mode[at(j)];
    log_mode -= rest;
    to.law.mode[at(j)] = std::exp(log_mode);
    if (log_mode > -std::numeric_limits<double>::infinity() && to.law.mode[at(j)] < smallest_plain)
      to.law.deep = 1.0;
  }
  merge(step, to, M);
  to.evidence.follow(from.evidence, 1.0, best + rest, static_cast<int>(z.size()));
  return true;
}

}  // namespace surefix::switching
