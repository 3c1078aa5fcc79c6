// A Markov chain in continuous time between modes: P(Δt) = e^{G Δt} for any Δt.
//
// By uniformisation, P = Σ_k e^{−a}aᵏ/k! Uᵏ with U = I + G/Λ ≥ 0 and a = ΛΔt, then by squaring:
// sums and products of non-negative numbers, so that a probability of 1e-20 is right to the last
// digits, which a difference in the exponent of G would not give.
#pragma once

#include <cmath>
#include <vector>

#include "surefix/core/status.hpp"

namespace surefix {

/// Transition probabilities of one chain of `size` modes; row-major.
class RateChain {
 public:
  RateChain() = default;

  /// A chain with rates G_ab ≥ 0 [1/s] from a to b ≠ a (the diagonal is not read).
  [[nodiscard]] ConfigStatus make(int size, const std::vector<double>& rates) {
    size_ = size;
    generator_ = rates;
    fastest_ = 0.0;
    for (int a = 0; a < size; ++a) {
      double leave = 0.0;
      for (int b = 0; b < size; ++b) {
        const double rate = a == b ? 0.0 : rates[at(a, b)];
        if (!std::isfinite(rate)) return ConfigStatus::not_finite;
        if (rate < 0.0) return ConfigStatus::negative;
        leave += rate;
      }
      if (!std::isfinite(leave)) return ConfigStatus::not_finite;
      generator_[at(a, a)] = -leave;
      fastest_ = leave > fastest_ ? leave : fastest_;
    }
    probability_.assign(generator_.size(), 0.0);
    power_ = next_ = probability_;
    set_identity(probability_);
    return ConfigStatus::ok;
  }

  /// Computes P(dt), dt ≥ 0 [s]; no heap.
  void advance(double dt) noexcept {
    if (dt == dt_) return;
    dt_ = dt;
    set_identity(probability_);
    if (fastest_ == 0.0) return;
    int squarings = 0;
    double a = fastest_ * dt;
    for (; a > 0.5 && squarings < 1000; a *= 0.5) ++squarings;
    double weight = std::exp(-a);
    set_identity(power_);
    for (double& p : probability_) p *= weight;
    for (int k = 1; k <= terms; ++k) {
      step(power_, next_);
      std::swap(power_, next_);
      weight *= a / k;
      for (std::size_t i = 0; i < power_.size(); ++i) probability_[i] += weight * power_[i];
    }
    for (int i = 0; i < squarings; ++i) square();
  }

  /// P(mode b at t + dt | mode a at t).
  [[nodiscard]] double operator()(int a, int b) const noexcept { return probability_[at(a, b)]; }
  [[nodiscard]] int size() const noexcept { return size_; }

 private:
  static constexpr int terms = 18;  // 0.5^18 / 18! < 1e-21

  [[nodiscard]] std::size_t at(int a, int b) const noexcept {
    return static_cast<std::size_t>(a * size_ + b);
  }
  void set_identity(std::vector<double>& matrix) const noexcept {
    for (int a = 0; a < size_; ++a)
      for (int b = 0; b < size_; ++b) matrix[at(a, b)] = a == b ? 1.0 : 0.0;
  }
  /// to = from U.
  void step(const std::vector<double>& from, std::vector<double>& to) const noexcept {
    for (int a = 0; a < size_; ++a)
      for (int b = 0; b < size_; ++b) {
        double sum = from[at(a, b)] * (1.0 + generator_[at(b, b)] / fastest_);
        for (int c = 0; c < size_; ++c)
          if (c != b) sum += from[at(a, c)] * (generator_[at(c, b)] / fastest_);
        to[at(a, b)] = sum;
      }
  }
  /// P ← P P, every row then scaled to one: a thousand squarings would double a rounding error
  /// each.
  void square() noexcept {
    for (int a = 0; a < size_; ++a) {
      double total = 0.0;
      for (int b = 0; b < size_; ++b) {
        double sum = 0.0;
        for (int c = 0; c < size_; ++c) sum += probability_[at(a, c)] * probability_[at(c, b)];
        next_[at(a, b)] = sum;
        total += sum;
      }
      for (int b = 0; b < size_; ++b) next_[at(a, b)] /= total;
    }
    std::swap(probability_, next_);
  }

  int size_ = 0;
  double dt_ = 0.0;
  double fastest_ = 0.0;  // Λ, the largest rate at which a mode is left
  std::vector<double> generator_, probability_, power_, next_;
};

}  // namespace surefix
