// The switching filters with sizes known at run time, over whole series. Small systems run in the
// fixed-size code.
#pragma once

#include <memory>

#include "surefix/core/linear_system.hpp"
#include "surefix/switching/batch_request.hpp"
#include "surefix/switching/linear_optimal.hpp"
#include "surefix/switching/method.hpp"
#include "surefix/switching/state_map.hpp"

namespace surefix::switching {

/// What `AnyFilter` is made from.
struct FilterPlan {
  std::vector<LinearSystem> systems;  ///< one, or for an IMM one for every mode
  ModeChain chain;
  /// Transitions of the modes: one, or one for each step but the first.
  std::vector<Eigen::MatrixXd> p;
  StateMap map;  ///< of systems with different states, else empty
};

/// A one-step filter, an IMM or a genie; immutable, so that threads may share it.
class AnyFilter {
 public:
  /// A bank of modes; not ok: `out` is left as it was. wrong_size, too, if systems, chain,
  /// transitions and map do not fit each other, or there are more than 32 states.
  [[nodiscard]] static ConfigStatus make(Method method, const FilterPlan& plan,
                                         std::unique_ptr<AnyFilter>& out);
  /// A genie that may know any of these modes.
  [[nodiscard]] static ConfigStatus make_genie(const LinearSystem& system,
                                               const std::vector<Mode>& modes,
                                               std::unique_ptr<AnyFilter>& out);

  virtual ~AnyFilter() = default;
  /// Runs some of the series; the others' outputs are left as they are. `in.T` is the number of
  /// steps that the matrices are for, or any. Room is taken from the heap before the first step,
  /// none in the steps.
  [[nodiscard]] virtual BatchStatus run(const BatchRequest& in, const BatchOutput& out) const = 0;
};

/// The linear optimal filter over whole series: gains computed once, and for a series that lacks
/// measurements once more for it alone.
class AnyLinearFilter {
 public:
  /// `nominal` (steps × n) or none.
  [[nodiscard]] static ConfigStatus make(const LinearSystem& system, const ModeChain& chain,
                                         const std::vector<Eigen::MatrixXd>& p,
                                         const Eigen::MatrixXd& nominal, AnyLinearFilter& out);

  /// As `AnyFilter::run`; modes have no probabilities and the measurements no likelihood.
  [[nodiscard]] BatchStatus run(const BatchRequest& in, const BatchOutput& out) const;

 private:
  /// Gains, errors and E γ_k of all steps; `z` (T, m) names the components that exist.
  struct Gains {
    std::vector<LinearGain> gain;
    std::vector<Eigen::MatrixXd> error;
    std::vector<double> mean_gamma;
  };
  [[nodiscard]] bool compute(const double* z, int T, Gains& out, int& failed) const;
  [[nodiscard]] BatchStatus filter(const Gains& gains, const BatchRequest& in, std::int64_t run,
                                   const BatchOutput& out) const;

  LinearSystem system_;
  ModeChain chain_;
  std::vector<Eigen::MatrixXd> p_;
  Eigen::MatrixXd nominal_;
};

}  // namespace surefix::switching
