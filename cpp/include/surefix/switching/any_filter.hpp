// The switching filters with sizes known at run time, over whole series. Small systems run in the
// fixed-size code.
#pragma once

#include <memory>

#include "surefix/switching/batch.hpp"
#include "surefix/switching/linear_optimal.hpp"

namespace surefix::switching {

/// What `AnyFilter` is made from.
struct FilterPlan {
  std::vector<LinearSystem> systems;  ///< one, or for an IMM one for every mode
  ModeChain chain;
  std::vector<Eigen::MatrixXd>
      p;         ///< transitions of the modes: one, or one for each step but the first
  StateMap map;  ///< of systems with different states, else empty
};

/// A one-step filter, an IMM or a genie; immutable, so that threads may share it.
class AnyFilter {
 public:
  /// A bank of modes; not ok: `out` is empty.
  [[nodiscard]] static ConfigStatus make(Method method, const FilterPlan& plan,
                                         std::unique_ptr<AnyFilter>& out);
  /// A genie that may know any of these modes.
  [[nodiscard]] static ConfigStatus make_genie(const LinearSystem& system,
                                               const std::vector<Mode>& modes,
                                               std::unique_ptr<AnyFilter>& out);

  virtual ~AnyFilter() = default;
  /// Runs some of the series; the others' outputs are left as they are. Room is taken from the
  /// heap before the first step, none in the steps.
  [[nodiscard]] virtual BatchStatus run(const BatchRequest& in, const BatchOutput& out) const = 0;
};

/// The linear optimal filter over whole series: gains computed once, and for a series that lacks
/// measurements once more for it alone.
class AnyLinearFilter {
 public:
  /// `nominal` (steps × n) or none.
  AnyLinearFilter(const LinearSystem& system, const ModeChain& chain,
                  const std::vector<Eigen::MatrixXd>& p, const Eigen::MatrixXd& nominal)
      : system_(system), chain_(chain), p_(p), nominal_(nominal) {}

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
