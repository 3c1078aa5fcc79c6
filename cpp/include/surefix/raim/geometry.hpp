// The weighted least-squares geometry of one epoch: position along the track, one clock a system.
//
// Whitened, the column of l is g_i = d_i'/σ_i; less what the clocks explain it is √G q, ‖q‖ = 1,
// and nothing needs to be factorised:
//   l̂ − l₀ = qᵀy/√G,   σ_l = 1/√G,   P_ij = q_i q_j + the clocks' hat.
#pragma once

#include <cmath>

#include "surefix/raim/clocks.hpp"

namespace surefix::raim {

class Geometry {
 public:
  Geometry() = default;
  /// `slope` (n): d'(l) of every satellite.
  Geometry(const Clocks& clocks, const double* slope) noexcept : clocks_(clocks) {
    double before = 0.0, left = 0.0;
    for (int i = 0; i < size(); ++i) {
      q_[at(i)] = slope[i] * clocks.root_weight(i);
      before += q_[at(i)] * q_[at(i)];
    }
    clocks.remove(q_.data());
    for (int i = 0; i < size(); ++i) left += q_[at(i)] * q_[at(i)];
    determined_ = left > 1e-12 * before;  // else all are in one direction
    root_G_ = std::sqrt(left);
    for (int i = 0; i < size(); ++i) q_[at(i)] = determined_ ? q_[at(i)] / root_G_ : 0.0;
  }

  [[nodiscard]] int size() const noexcept { return clocks_.size(); }
  /// Degrees of freedom of the residual.
  [[nodiscard]] int degrees() const noexcept { return size() - 1 - clocks_.systems(); }
  /// Whether l̂ exists.
  [[nodiscard]] bool determined() const noexcept { return determined_; }
  /// σ_l [m].
  [[nodiscard]] double sigma() const noexcept { return 1.0 / root_G_; }
  /// Effect on l̂ of a whitened error of 1 in satellite i [m].
  [[nodiscard]] double effect(int i) const noexcept { return q_[at(i)] / root_G_; }
  /// (I − P)_ij: what the residual shows of an error.
  [[nodiscard]] double seen(int i, int j) const noexcept {
    return (i == j ? 1.0 : 0.0) - q_[at(i)] * q_[at(j)] - clocks_.hat(i, j);
  }
  [[nodiscard]] const Clocks& clocks() const noexcept { return clocks_; }

  /// y (n, whitened) ← (I − P) y; returns the shift of l that it had in it [m].
  double remove(double* y) const noexcept {
    clocks_.remove(y);
    double along = 0.0;
    for (int i = 0; i < size(); ++i) along += q_[at(i)] * y[i];
    for (int i = 0; i < size(); ++i) y[i] -= along * q_[at(i)];
    return along / root_G_;
  }

 private:
  [[nodiscard]] static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  Clocks clocks_;
  bool determined_ = false;
  double root_G_ = 0.0;
  std::array<double, max_satellites> q_;
};

}  // namespace surefix::raim
