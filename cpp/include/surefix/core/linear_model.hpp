// Any continuous linear model dx = A x dt + L dw, cov(dw) = Q_c dt, discretised exactly:
//   F(Δt) = e^{A Δt},  Q(Δt) = ∫₀^Δt e^{A s} W e^{Aᵀ s} ds,  W = L Q_c Lᵀ.
//
// Van Loan (1978) reads both from one exponential of a 2n × 2n matrix that contains e^{−A Δt},
// which overflows for a stable A and a long gap. The same integral by series and doubling has no
// growing part and keeps Q ≥ 0: Taylor series over a step h so short that ‖A‖ h ≤ 1/4, then
//   F(2h) = F(h)²,  Q(2h) = F(h) Q(h) F(h)ᵀ + Q(h)   (the semigroup property), at most 120 times.
#pragma once

#include <cmath>

#include "surefix/core/predict.hpp"
#include "surefix/core/status.hpp"
#include "surefix/core/time.hpp"
#include "surefix/core/transition.hpp"

namespace surefix {

/// Continuous linear model of n ≤ MaxN states.
template <int N, int MaxN = N>
class LinearModel {
 public:
  static constexpr int size = N;
  static constexpr int max_size = MaxN;
  static constexpr int output = -1;  // none: the rows of the sensors say what they read
  using Transition = DenseTransition<N, MaxN>;
  using Matrix = typename Transition::Matrix;

  /// A (n × n) [1/s] and W = L Q_c Lᵀ (n × n, exactly symmetric, positive semidefinite) [x²/s].
  LinearModel(const Matrix& A, const Matrix& W) noexcept : A_(A), W_(W) {}

  [[nodiscard]] ConfigStatus check() const noexcept {
    if (A_.rows() != A_.cols() || W_.rows() != A_.rows()) return ConfigStatus::wrong_size;
    return A_.allFinite() ? check_covariance(W_) : ConfigStatus::not_finite;
  }

  [[nodiscard]] int state_size() const noexcept { return static_cast<int>(A_.rows()); }

  /// F and Q over `elapsed` ≥ 0; `numerical` if they overflow (an unstable A over a long gap).
  [[nodiscard]] Status transition(Time elapsed, Transition& out) const noexcept {
    const double dt = seconds(elapsed);
    int doublings = 0;
    double norm = one_norm() * dt;
    for (; norm > 0.25 && doublings < max_doublings; norm *= 0.5) ++doublings;
    if (!(norm <= 0.25)) return Status::numerical;
    series(std::ldexp(dt, -doublings), out);
    for (int i = 0; i < doublings; ++i) twice(out);
    return finite(out) ? Status::ok : Status::numerical;
  }

 private:
  static constexpr int max_doublings = 120;
  static constexpr int terms = 14;  // (1/4)^14 / 14! < 1e-19

  [[nodiscard]] double one_norm() const noexcept {
    double largest = 0.0;
    for (int j = 0; j < state_size(); ++j) {
      double sum = 0.0;
      for (int i = 0; i < state_size(); ++i) sum += std::abs(A_(i, j));
      if (!(sum <= largest)) largest = sum;
    }
    return largest;
  }

  /// F = Σ (A h)^k / k!,  Q = Σ T_k h^{k+1} / (k+1)!  with T_0 = W, T_{k+1} = A T_k + T_k Aᵀ.
  void series(double h, Transition& out) const noexcept {
    const int n = state_size();
    Matrix power = Matrix::Identity(n, n);
    Matrix T = W_ * h;
    Matrix product(n, n);
    out.F = power;
    out.Q = T;
    for (int k = 1; k <= terms; ++k) {
      product.noalias() = A_.lazyProduct(power);
      power = product * (h / k);
      out.F += power;
      product.noalias() = A_.lazyProduct(T);
      T = (product + product.transpose()) * (h / (k + 1));
      out.Q += T;
    }
    mirror(out.Q);
  }

  static void twice(Transition& step) noexcept {
    Matrix Q = step.Q;
    propagate(Q, step);
    step.Q += Q;
    const Matrix F = step.F;
    step.F.noalias() = F.lazyProduct(F);
  }

  [[nodiscard]] static bool finite(const Transition& step) noexcept {
    return step.F.allFinite() && step.Q.allFinite();
  }

  Matrix A_;
  Matrix W_;
};

}  // namespace surefix
