// The same step in logarithms, for the measurements after which a plain density is zero.
#pragma once

#include "surefix/switching/step.hpp"

namespace surefix::switching {

/// Whether the last place of an estimate is worth more than its standard deviation: no interval
/// around it means anything then, and differences between modes' means are rounding.
template <class G>
[[nodiscard]] bool out_of_digits(const G& belief) noexcept {
  constexpr double digits = 0x1p52;
  for (int a = 0; a < belief.size(); ++a) {
    const double least = belief.x(a) / digits;
    if (belief.P(a, a) > 0.0 && least * least > belief.P(a, a)) return true;
  }
  return false;
}

/// The same in logarithms, for one series. False if an innovation's variance is not positive or no
/// mode has a density; and of a measurement 1e8 σ from what every mode expects (`least_told`) if
/// several are equally far but for rounding, or the estimate would be out of digits.
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
  const bool absurd = best < least_told;
  if (absurd && rest > 0.0) return false;
  to.law.deep = 0.0;
  for (int j = 0; j < M; ++j) {
    double& log_mode = to.law.log_mode[at(j)];
    log_mode -= rest;
    to.law.mode[at(j)] = std::exp(log_mode);
    if (log_mode > -std::numeric_limits<double>::infinity() && to.law.mode[at(j)] < smallest_plain)
      to.law.deep = 1.0;
  }
  merge(step, to, M);
  if (absurd && out_of_digits(to.merged)) return false;
  to.evidence.follow(from.evidence, 1.0, best + rest, static_cast<int>(z.size()));
  return true;
}

}  // namespace surefix::switching
