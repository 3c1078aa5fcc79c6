// A model that is known only at a fixed period: x_{k+1} = F x_k + w, cov(w) = Q.
#pragma once

#include "surefix/core/predict.hpp"
#include "surefix/core/status.hpp"
#include "surefix/core/time.hpp"
#include "surefix/core/transition.hpp"

namespace surefix {

/// Discrete model of n ≤ MaxN states. It has transitions over whole periods only; any other
/// duration is answered by `off_grid`, not by an interpolation that nobody asked for.
template <int N, int MaxN = N>
class DiscreteModel {
 public:
  static constexpr int size = N;
  static constexpr int max_size = MaxN;
  static constexpr int output = -1;  // none: the rows of the sensors say what they read
  using Transition = DenseTransition<N, MaxN>;
  using Matrix = typename Transition::Matrix;

  /// F (n × n), Q (n × n, exactly symmetric, positive semidefinite) over `period` > 0 [ns].
  DiscreteModel(const Matrix& F, const Matrix& Q, Time period) noexcept
      : one_{{F}, Q}, period_(period) {}

  [[nodiscard]] ConfigStatus check() const noexcept {
    const Matrix &F = one_.F, &Q = one_.Q;
    if (F.rows() != F.cols() || Q.rows() != F.rows()) return ConfigStatus::wrong_size;
    if (!F.allFinite()) return ConfigStatus::not_finite;
    return period_ > 0 ? check_covariance(Q) : ConfigStatus::not_positive;
  }

  [[nodiscard]] int state_size() const noexcept { return static_cast<int>(one_.F.rows()); }

  /// F^k and the noise of k periods, k = elapsed / period ≥ 0, by repeated squaring.
  [[nodiscard]] Status transition(Time elapsed, Transition& out) const noexcept {
    if (period_ <= 0 || elapsed % period_ != 0) return Status::off_grid;
    const int n = state_size();
    out.F = Matrix::Identity(n, n);
    out.Q = Matrix::Zero(n, n);
    Transition power = one_;
    for (Time k = elapsed / period_; k > 0; k /= 2) {
      if (k % 2 == 1) out = after(out, power);
      if (k > 1) power = after(power, power);
    }
    return out.F.allFinite() && out.Q.allFinite() ? Status::ok : Status::numerical;
  }

 private:
  /// The transition `first`, then `second`.
  [[nodiscard]] static Transition after(const Transition& first,
                                        const Transition& second) noexcept {
    Transition both = first;
    both.F.noalias() = second.F.lazyProduct(first.F);
    propagate(both.Q, second);
    both.Q += second.Q;
    return both;
  }

  Transition one_;
  Time period_;
};

}  // namespace surefix
