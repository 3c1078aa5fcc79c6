// The hypotheses per sensor of one step: every component under every hypothesis of the mode table
// that its modes and the prior leave possible.
#pragma once

#include <limits>
#include <vector>

#include "surefix/robust/hypothesis_pack.hpp"
#include "surefix/robust/mixture_state.hpp"
#include "surefix/robust/mode_prior.hpp"

namespace surefix::robust {

template <class FaultSystem>
class Branches {
 public:
  static constexpr std::size_t most = 1 << 15;  ///< at a time

  Branches(const FaultSystem& system, std::size_t capacity) : pack_(system), source_(capacity) {}

  /// Puts the branches of `state`, with their prior log-weights, into `to`. Those of a log-weight
  /// below `worth` and those for which there is no room are left out, as are more faults at once
  /// than the table has: returns their mass. `carried`: the components have modes; otherwise the
  /// posterior of the modes is that of `state.mode`.
  [[nodiscard]] double make(const ModeTable& table, const ModePrior& prior,
                            const MixtureState& state, bool carried, double worth,
                            Components& to) noexcept {
    double lost = 0.0;
    std::size_t count = 0;
    for (std::size_t c = 0; c < state.components.count(); ++c) {
      const double before = state.components.log_weight(c);
      for (int h = 0; h < table.count(); ++h) {
        const double log_weight =
            before + (carried ? prior.log_probability(table, state.components.hypothesis(c), h)
                              : log_prior_of_modes(table, prior, state.mode, h));
        const double weight = std::exp(log_weight);
        if (!(log_weight > worth) || count == to.capacity()) {
          lost += weight;
          continue;
        }
        to.log_weight(count) = log_weight;
        to.hypothesis(count) = h;
        source_[count++] = static_cast<int>(c);
      }
      if (!table.complete())
        lost += std::exp(before) * (carried ? prior.left_out(table, state.components.hypothesis(c))
                                            : left_out(table, prior, state.mode));
    }
    to.resize(count);
    return lost;
  }

  /// The component that the b-th comes from.
  [[nodiscard]] std::size_t source(std::size_t b) const noexcept {
    return static_cast<std::size_t>(source_[b]);
  }

  /// Runs all of them over the step.
  [[nodiscard]] Status run(const FaultSystem& system, const ModeTable& table,
                           const StepPlan<FaultSystem>& plan, const Components& from,
                           Components& to) noexcept {
    constexpr std::size_t lanes = HypothesisPack<FaultSystem>::lanes;
    const std::size_t count = to.count();
    for (std::size_t first = 0; first < count; first += lanes) {
      for (std::size_t l = 0; l < lanes; ++l) {
        const std::size_t b = std::min(first + l, count - 1);  // the last one fills the pack
        pack_.load(system, table, static_cast<int>(l), from, static_cast<std::size_t>(source_[b]),
                   to.hypothesis(b));
      }
      const Status status = pack_.run(system, plan);
      if (status != Status::ok) return status;
      for (std::size_t l = 0; l < lanes && first + l < count; ++l)
        pack_.store(system, table, plan, static_cast<int>(l), to, first + l);
    }
    return Status::ok;
  }

 private:
  static double left_out(const ModeTable& table, const ModePrior& prior,
                         const std::vector<double>& mode) noexcept {
    double sum = 0.0;
    for (int a = 0; a < table.count(); ++a)
      sum += mode[static_cast<std::size_t>(a)] * prior.left_out(table, a);
    return sum;
  }

  /// log Σ_a p(a | past) p(h | a) for the one Gaussian.
  static double log_prior_of_modes(const ModeTable& table, const ModePrior& prior,
                                   const std::vector<double>& mode, int h) noexcept {
    double sum = 0.0;
    for (int a = 0; a < table.count(); ++a) {
      const double p = mode[static_cast<std::size_t>(a)];
      if (p > 0.0) sum += p * std::exp(prior.log_probability(table, a, h));
    }
    return std::log(sum);
  }

  HypothesisPack<FaultSystem> pack_;
  std::vector<int> source_;  // the component that each comes from
};

}  // namespace surefix::robust
