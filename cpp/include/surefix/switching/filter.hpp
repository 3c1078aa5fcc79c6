// A switching filter onboard: sizes fixed, no heap after it is made, the same bits as in batches.
#pragma once

#include "surefix/switching/recursion.hpp"

namespace surefix::switching {

/// One-step near-optimal filter or IMM of one system, measurement by measurement.
///
/// `S` are `Sizes`. A step that fails leaves the filter as it was.
template <Method method, class S>
class Filter {
 public:
  using Matrix = typename Belief<S>::Matrix;
  using Vector = typename Belief<S>::Vector;

  Filter() = default;

  /// x_0 ~ N(x0, P0), the first measurement is of x_0. wrong_size if the chain has not S::M modes.
  [[nodiscard]] ConfigStatus make(const ModeChain& chain, const Belief<S>& initial) {
    ModeTable<S> modes;
    ConfigStatus status = initial.check();
    if (status == ConfigStatus::ok) status = modes.make(chain, S::m);
    if (status != ConfigStatus::ok) return status;
    recursion_.make(modes, 1);
    for (int j = 0; j < S::M; ++j) {
      state_.bank[at(j)] = initial;
      state_.law.mode[at(j)] = chain.initial(j);
      for (int i = 0; i < S::M; ++i) p_[at(i * S::M + j)] = chain.transition(i, j);
    }
    state_.merged = initial;
    state_.law.deep = 0.0;
    state_.evidence = {};
    first_ = true;
    return status;
  }

  /// From now on the modes move by these transitions, rows before: for steps that differ in length.
  /// False, and nothing is changed, if a row is no law.
  [[nodiscard]] bool set_transitions(std::array<double, at(S::M* S::M)> p) noexcept {
    for (int i = 0; i < S::M; ++i) {
      double sum = 0.0;
      for (int j = 0; j < S::M; ++j) {
        if (!(p[at(i * S::M + j)] >= 0.0)) return false;
        sum += p[at(i * S::M + j)];
      }
      if (!(std::abs(sum - 1.0) <= 1e-9)) return false;
      for (int j = 0; j < S::M && sum != 1.0; ++j) p[at(i * S::M + j)] /= sum;
    }
    p_ = p;
    for (int i = 0; i < S::M; ++i)
      for (int j = 0; j < S::M; ++j)
        if (p[at(i * S::M + j)] > 0.0) recursion_.allow(j);
    return true;
  }

  /// The estimate at the next measurement; NaN in z are missing components. `transition` leads
  /// to it from the one before and is not read by the first.
  ///
  /// not_finite: z is infinite. numerical: the prediction overflows, no mode has a density, or
  /// z is so far from all modes (> 1e8 σ) that doubles do not tell them apart, or its last place is
  /// worth more than the estimate's standard deviation. The filter is as it was.
  [[nodiscard]] Status step(const Transition<S>& transition, const Observation<S>& observation,
                            const Measured<S>& z) noexcept {
    const Transition<S>* const transitions = &transition;
    const Observation<S>* const observations = &observation;
    const Step<S> step{first_ ? nullptr : &transitions, p_.data(), false, nullptr};
    const Status status = recursion_.alone(step, &observations, z, state_, next_);
    if (status != Status::ok) return status;
    std::swap(state_, next_);
    first_ = false;
    return status;
  }

  /// Mean and covariance of the state, given all measurements so far.
  [[nodiscard]] const Belief<S>& estimate() const noexcept { return state_.merged; }
  /// Probability of a mode.
  [[nodiscard]] double mode(int j) const noexcept { return state_.law.mode[at(j)]; }
  /// log p of all measurements so far.
  [[nodiscard]] double log_likelihood() const noexcept { return state_.evidence.log_likelihood(0); }

 private:
  Recursion<method, S> recursion_;
  State<S, double> state_, next_;
  std::array<double, at(S::M* S::M)> p_{};
  bool first_ = true;
};

}  // namespace surefix::switching
