// Weighted Gaussians in one block of memory: the components that live from step to step, and the
// hypotheses of one step.
#pragma once

#include <cstddef>
#include <vector>

namespace surefix::robust {

/// Room for `capacity` Gaussians of n states, each with a log-weight and a hypothesis.
class Components {
 public:
  Components() = default;
  Components(int n, std::size_t capacity)
      : n_(n),
        log_weight_(capacity),
        hypothesis_(capacity),
        squares_(capacity),
        x_(capacity * static_cast<std::size_t>(n)),
        P_(capacity * static_cast<std::size_t>(n * n)) {}

  [[nodiscard]] int state_size() const noexcept { return n_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return log_weight_.size(); }
  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  void resize(std::size_t count) noexcept { count_ = count; }  // ≤ capacity

  [[nodiscard]] double& log_weight(std::size_t c) noexcept { return log_weight_[c]; }
  [[nodiscard]] double log_weight(std::size_t c) const noexcept { return log_weight_[c]; }
  /// Index in the mode table.
  [[nodiscard]] int& hypothesis(std::size_t c) noexcept { return hypothesis_[c]; }
  [[nodiscard]] int hypothesis(std::size_t c) const noexcept { return hypothesis_[c]; }
  /// Σ ν²/S of the measurements that the hypothesis did not remove.
  [[nodiscard]] double& squares(std::size_t c) noexcept { return squares_[c]; }
  [[nodiscard]] double squares(std::size_t c) const noexcept { return squares_[c]; }
  /// (n), and (n × n) column by column.
  [[nodiscard]] double* x(std::size_t c) noexcept {
    return x_.data() + c * static_cast<std::size_t>(n_);
  }
  [[nodiscard]] const double* x(std::size_t c) const noexcept {
    return x_.data() + c * static_cast<std::size_t>(n_);
  }
  [[nodiscard]] double* P(std::size_t c) noexcept {
    return P_.data() + c * static_cast<std::size_t>(n_ * n_);
  }
  [[nodiscard]] const double* P(std::size_t c) const noexcept {
    return P_.data() + c * static_cast<std::size_t>(n_ * n_);
  }

  /// Takes over component `from` of `other` as component `to`.
  void copy(std::size_t to, const Components& other, std::size_t from) noexcept {
    log_weight_[to] = other.log_weight(from);
    hypothesis_[to] = other.hypothesis(from);
    squares_[to] = other.squares(from);
    for (int i = 0; i < n_; ++i) x(to)[i] = other.x(from)[i];
    for (int i = 0; i < n_ * n_; ++i) P(to)[i] = other.P(from)[i];
  }

 private:
  int n_ = 0;
  std::size_t count_ = 0;
  std::vector<double> log_weight_;
  std::vector<int> hypothesis_;
  std::vector<double> squares_, x_, P_;
};

}  // namespace surefix::robust
