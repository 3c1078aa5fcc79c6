// What is known of the modes: their probabilities, and how a step of the chain moves them.
//
// Probabilities are plain numbers as long as they are above 1e-150: then nothing that a step
// multiplies them with is lost below the smallest double. A series in which one falls lower takes
// its steps in logarithms, alone, until they are all above again: a gross outlier must not make all
// modes equal.
#pragma once

#include <cmath>
#include <limits>

#include "surefix/core/lane.hpp"
#include "surefix/switching/sizes.hpp"

namespace surefix::switching {

/// The probability below which a step is taken in logarithms.
inline constexpr double smallest_plain = 1e-150;

/// Probabilities of the modes after a step; their logarithms where `deep` is not zero.
template <class S, class Lane>
struct ModeLaw {
  Bank<Lane, S::M> mode{};
  Bank<Lane, S::M> log_mode{};
  Lane deep = Lanes<Lane>::all(0.0);
};

/// Before the measurement of the next step: the probability of each mode now, and the share that
/// each mode before has in it (17).
template <class S, class Lane>
struct ModePrior {
  Bank<Lane, S::M> prior{};
  Bank<Lane, S::M> log_prior{};       // in logarithmic steps
  Bank<Lane, squared(S::M)> share{};  // at i M + j: P(mode i before | mode j now)
};

/// μ_j = Σ_i p_ij μ_i (10), and the shares; `p` (M × M), rows before.
template <class S, class Lane>
SUREFIX_INLINE void predict(const ModeLaw<S, Lane>& law, const double* p, int M,
                            ModePrior<S, Lane>& out) noexcept {
  loop<S::M>(M, [&](int j) SUREFIX_LAMBDA {
    out.prior[at(j)] =
        sum_of<S::M, Lane>(M, [&](int i) SUREFIX_LAMBDA { return law.mode[at(i)] * p[i * M + j]; });
    const Lane inverse = 1.0 / (out.prior[at(j)] + 1e-300);  // a mode that cannot be has no shares
    loop<S::M>(M, [&](int i) SUREFIX_LAMBDA {
      out.share[at(i * M + j)] = (law.mode[at(i)] * p[i * M + j]) * inverse;
    });
  });
}

/// log Σ e^v; −∞ if all are.
template <class Values>
[[nodiscard]] double log_sum(const Values& log_values, int count) noexcept {
  double most = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (int i = 0; i < count; ++i) most = greater(log_values[at(i)], most);
  if (!(most > -std::numeric_limits<double>::infinity())) return most;
  for (int i = 0; i < count; ++i) sum += std::exp(log_values[at(i)] - most);
  return most + std::log(sum);
}

/// The logarithms of the law's probabilities.
template <class S>
[[nodiscard]] double log_mode(const ModeLaw<S, double>& law, int i) noexcept {
  return law.deep != 0.0 ? law.log_mode[at(i)] : std::log(law.mode[at(i)]);
}

/// The same as `predict` in logarithms, of one series.
template <class S>
void predict_in_logs(const ModeLaw<S, double>& law, const double* p, int M,
                     ModePrior<S, double>& out) noexcept {
  constexpr double none = -std::numeric_limits<double>::infinity();
  for (int j = 0; j < M; ++j) {
    double most = none;
    for (int i = 0; i < M; ++i) {
      const double joint = log_mode(law, i) + std::log(p[i * M + j]);
      out.share[at(i * M + j)] = joint;
      most = greater(joint, most);
    }
    double sum = 0.0;
    for (int i = 0; i < M; ++i) {
      double& share = out.share[at(i * M + j)];
      share = most > none ? std::exp(share - most) : 0.0;
      sum += share;
    }
    for (int i = 0; i < M && sum > 0.0; ++i) out.share[at(i * M + j)] /= sum;
    out.log_prior[at(j)] = most > none ? most + std::log(sum) : none;
    out.prior[at(j)] = std::exp(out.log_prior[at(j)]);
  }
}

}  // namespace surefix::switching
