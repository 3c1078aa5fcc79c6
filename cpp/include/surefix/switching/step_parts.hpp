// The parts of a step of the one-step near-optimal filter (Sigalov & Oshman, section III) and of
// the IMM (section IV): each mode predicts, reads the measurement and says how probable it was; the
// answers are merged. The two filters differ only in what a mode starts from.
#pragma once

#include "surefix/core/predict.hpp"
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

}  // namespace surefix::switching
