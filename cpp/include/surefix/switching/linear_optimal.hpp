// The best filter that is linear in the measurements (Sigalov & Oshman, section V): its gains do
// not depend on them and are computed before the first one.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "surefix/core/status.hpp"
#include "surefix/switching/mode_chain.hpp"

namespace surefix::switching {

/// The fault-free system of one step; `A`, `Q` lead to it from the step before.
struct LinearStep {
  Eigen::MatrixXd A, Q;     // (n × n); of the first step not read
  Eigen::MatrixXd H, R;     // (m × n), (m × m)
  Eigen::VectorXd nominal;  // (n) x̄, or none
};

/// x̂ ← F1 x̂ + F2 z (23a); with a nominal trajectory of x̂ − x̄ and z − E[γ] H x̄.
struct LinearGain {
  Eigen::MatrixXd F1, F2;
};

/// What the gains of the next step are computed from. Offline: it uses the heap.
///
/// γ need not be 0 or 1: where the paper has Pr(γ_{k+1} = 1 | γ_k = 1) stands
/// E γ_{k+1} γ_k / E γ_k, and in (23c), (23e) E γ² where it multiplies H C Hᵀ.
class LinearRecursion {
 public:
  /// Before the first measurement: x_0 ~ N(x0, P0), or about the nominal trajectory N(0, P0).
  LinearRecursion(const ModeChain& chain, const Eigen::VectorXd& x0, const Eigen::MatrixXd& P0,
                  bool nominal);

  /// The gain of the next step, of whose measurement the components `present` exist (null: all;
  /// in F2 the others' columns are zero); `p` the transitions of the modes that lead to it, null in
  /// the first step. False if the gain's matrix is not definite.
  [[nodiscard]] bool advance(const LinearStep& step, const Eigen::MatrixXd* p, const bool* present,
                             LinearGain& gain);

  /// E (x − x̂)(x − x̂)ᵀ (n × n), exact for this chain whether the filter is optimal or not.
  [[nodiscard]] Eigen::MatrixXd error() const;
  /// The same if it is optimal: C − V.
  [[nodiscard]] Eigen::MatrixXd error_if_optimal() const { return C_ - V_; }
  /// Pr(γ_k = 1 | γ_i = 1) of the last step k, i the last one before it with E γ_i ≠ 0; 0 where
  /// there is none.
  [[nodiscard]] double p11() const noexcept { return p11_; }
  [[nodiscard]] double mean_gamma() const noexcept { return mean_gamma_; }

 private:
  ModeChain chain_;
  Eigen::VectorXd law_;    // of the mode, in the last step
  Eigen::VectorXd seen_;   // the same given γ_i
  Eigen::MatrixXd C_, V_;  // E x xᵀ, E x̂ x̂ᵀ as the recursion (23d, e) has them
  // For every mode j, with 1_j where it is the mode: E x xᵀ1_j, E x̂ xᵀ1_j, E x̂ x̂ᵀ1_j, E x̂ 1_j.
  std::vector<Eigen::MatrixXd> xx_, ex_, ee_;
  std::vector<Eigen::VectorXd> e_;
  bool nominal_;
  double p11_ = 0.0, mean_gamma_ = 0.0;
};

/// Lemma 2: whether E γ_k γ_i / E γ_i, which is Pr(γ_k = 1 | γ_i = 1), is the same for all i < k.
struct LinearCondition {
  bool holds;
  double lowest, highest;  ///< over all k and i of what should be one number for each k
  double spread;           ///< the largest difference between i for one k
  double p11;              ///< with i = k − 1, of the last step
  int lags;                ///< k − i was looked at up to this
};

/// Checks `steps` ≥ 2 measurements; `p` one matrix for all steps, or one for each but the first.
/// Lags up to 256: of a chain with the same transitions throughout, as many as it has modes
/// would do (Cayley and Hamilton).
[[nodiscard]] LinearCondition check_linear(const ModeChain& chain,
                                           const std::vector<Eigen::MatrixXd>& p, int steps);

}  // namespace surefix::switching
