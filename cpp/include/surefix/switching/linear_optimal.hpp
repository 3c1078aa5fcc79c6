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
/// E γ_{k+1} γ_i / E γ_i, i the last step before with E γ_i ≠ 0, and in (23c), (23e) E γ² where it
/// multiplies H C Hᵀ. What is carried is the error's covariance Σ = C − V, not V: far from the
/// origin C and V are large and nearly equal.
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
  /// The same if it is optimal: C − V of (23).
  [[nodiscard]] const Eigen::MatrixXd& error_if_optimal() const noexcept { return Sigma_; }
  [[nodiscard]] double mean_gamma() const noexcept { return mean_gamma_; }

 private:
  /// With e = x − x̂ and 1_j where the mode is j: E x xᵀ1_j, E e xᵀ1_j, E e eᵀ1_j, E e 1_j.
  struct Moments {
    Eigen::MatrixXd xx, ex, ee;
    Eigen::VectorXd e;

    void scale(double p) {
      xx *= p;
      ex *= p;
      ee *= p;
      e *= p;
    }
    void add(double p, const Moments& other) {
      xx += p * other.xx;
      ex += p * other.ex;
      ee += p * other.ee;
      e += p * other.e;
    }
  };

  void move(const LinearStep& step, const Eigen::MatrixXd& p);

  ModeChain chain_;
  Eigen::VectorXd law_;        // of the mode, in the last step
  Eigen::VectorXd seen_;       // the same given γ_i = 1 in the last step i with E γ_i ≠ 0
  Eigen::MatrixXd C_, Sigma_;  // E x xᵀ, and C − V: the error's covariance as (23) has it
  std::vector<Moments> modes_;
  bool nominal_;
  double mean_gamma_ = 0.0;
};

/// Lemma 2: whether E γ_k γ_i / E γ_i, which is Pr(γ_k = 1 | γ_i = 1), is the same for all i < k.
struct LinearCondition {
  bool holds;
  double lowest, highest;  ///< over all k and i of what should be one number for each k
  double spread;           ///< the largest difference between i for one k
  double p11;              ///< with i = k − 1, of the last step
  int lags;                ///< so many i with E γ_i ≠ 0 before k were looked at
};

/// Checks `steps` ≥ 2 measurements; `p` one matrix for all steps, or one for each but the first.
/// Lags up to 256: of a chain with the same transitions throughout, as many as it has modes
/// would do (Cayley and Hamilton).
[[nodiscard]] LinearCondition check_linear(const ModeChain& chain,
                                           const std::vector<Eigen::MatrixXd>& p, int steps);

}  // namespace surefix::switching
