// The fault-free system: x_{k+1} = A x_k + w, cov(w) = Q; z_k = H x_k + v, cov(v) = R (1), (2).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "surefix/core/covariance.hpp"
#include "surefix/core/observation.hpp"

namespace surefix {

/// Matrices of one step for all, or of every step; x_0 ~ N(x0, P0), and the first measurement is
/// of x_0.
struct LinearSystem {
  std::vector<Eigen::MatrixXd> A, Q;  // (n × n): 1, or one less than measurements; k leads to k + 1
  std::vector<Eigen::MatrixXd> H, R;  // (m × n), (m × m, positive definite): 1, or one each
  Eigen::VectorXd x0;
  Eigen::MatrixXd P0;

  [[nodiscard]] int size() const noexcept { return static_cast<int>(x0.size()); }
  [[nodiscard]] int measured() const noexcept {
    return H.empty() ? 0 : static_cast<int>(H.front().rows());
  }
  /// The steps that its matrices are for; 0 where they are for any number.
  [[nodiscard]] int steps() const noexcept {
    int steps = 0;
    for (const auto* of : {&A, &Q})
      if (of->size() > 1) steps = static_cast<int>(of->size()) + 1;
    for (const auto* of : {&H, &R})
      if (of->size() > 1) steps = static_cast<int>(of->size());
    return steps;
  }
};

/// The matrices of a step, k = 0, 1, …, in which there may be one for all.
template <class T>
[[nodiscard]] const T& of_step(const std::vector<T>& all, int k) noexcept {
  return all.size() == 1 ? all.front() : all[static_cast<std::size_t>(k)];
}

/// A system in the form that the steps read.
template <class S>
class PreparedSystem {
 public:
  /// Checks sizes, numbers and matrices.
  [[nodiscard]] ConfigStatus make(const LinearSystem& system) {
    const int n = system.size(), m = system.measured();
    if (!fits(n, S::n, S::max_n) || !fits(m, S::m, S::max_m)) return ConfigStatus::wrong_size;
    if (system.A.empty() != system.Q.empty() || system.H.empty() || system.R.empty() ||
        !pair(system.A, system.Q) || !pair(system.H, system.R))
      return ConfigStatus::wrong_size;
    if (system.P0.rows() != n || system.P0.cols() != n) return ConfigStatus::wrong_size;
    for (std::size_t k = 0; k < std::max(system.A.size(), system.Q.size()); ++k) {
      const Eigen::MatrixXd &A = of_step(system.A, static_cast<int>(k)),
                            &Q = of_step(system.Q, static_cast<int>(k));
      if (A.rows() != n || A.cols() != n || Q.rows() != n) return ConfigStatus::wrong_size;
      if (!A.allFinite()) return ConfigStatus::not_finite;
      if (const auto status = check_covariance(Q); status != ConfigStatus::ok) return status;
      transitions_.push_back({{A}, Q});
    }
    for (std::size_t k = 0; k < std::max(system.H.size(), system.R.size()); ++k) {
      const Eigen::MatrixXd &H = of_step(system.H, static_cast<int>(k)),
                            &R = of_step(system.R, static_cast<int>(k));
      if (H.rows() != m || H.cols() != n || R.rows() != m || R.cols() != m)
        return ConfigStatus::wrong_size;
      observations_.emplace_back();
      if (const auto status = observations_.back().make(H, R); status != ConfigStatus::ok)
        return status;
    }
    initial_ = {system.x0, system.P0};
    return initial_.check();
  }

  /// From measurement k − 1 to k, k ≥ 1.
  [[nodiscard]] const TransitionOf<S>& transition(int k) const noexcept {
    return of_step(transitions_, k - 1);
  }
  [[nodiscard]] const Observation<S>& observation(int k) const noexcept {
    return of_step(observations_, k);
  }
  [[nodiscard]] const BeliefOf<S>& initial() const noexcept { return initial_; }
  [[nodiscard]] int size() const noexcept { return initial_.size(); }
  [[nodiscard]] int measured() const noexcept { return observations_.front().size(); }

 private:
  /// As many of one as of the other, or one for all.
  template <class T>
  [[nodiscard]] static bool pair(const std::vector<T>& a, const std::vector<T>& b) noexcept {
    return a.size() == b.size() || a.size() == 1 || b.size() == 1;
  }
  [[nodiscard]] static bool fits(int size, int fixed, int most) noexcept {
    return size > 0 && (fixed == Eigen::Dynamic ? size <= most : size == fixed);
  }

  std::vector<TransitionOf<S>> transitions_;
  std::vector<Observation<S>> observations_;
  BeliefOf<S> initial_;
};

}  // namespace surefix
