// What a χ² test detects, and what it does when the model under it bends (Lacresse, Grall &
// Nikiforov 2005, eq. 6 and section 4.3).
//
// A fault of noncentrality λ seen through a linearisation error of at most b (in standard
// deviations) has a noncentrality between max(√λ − b, 0)² and (√λ + b)².
#pragma once

namespace surefix::raim {

/// A test Λ ≥ threshold with `degrees` degrees of freedom.
struct ChiSquaredTest {
  double degrees;
  double threshold;  ///< h(α)

  /// β(λ) = P(Λ ≥ h).
  [[nodiscard]] double power(double noncentrality) const noexcept;
  /// 1 − β(λ), with its relative precision however small.
  [[nodiscard]] double missed(double noncentrality) const noexcept;
  /// The least power at noncentrality λ, β₁.
  [[nodiscard]] double least_power(double noncentrality, double bound) const noexcept;
  /// 1 − β₁.
  [[nodiscard]] double most_missed(double noncentrality, double bound) const noexcept;
  /// The greatest power, β₂.
  [[nodiscard]] double most_power(double noncentrality, double bound) const noexcept;
  /// e₁(λ) = β − β₁ ≥ 0.
  [[nodiscard]] double loss(double noncentrality, double bound) const noexcept;
  /// e₂(λ) = β₂ − β ≥ 0; at λ = 0 it is what false alarms gain.
  [[nodiscard]] double gain(double noncentrality, double bound) const noexcept;
  /// The suprema of e₁ and e₂ over all λ.
  [[nodiscard]] double worst_loss(double bound) const noexcept;
  [[nodiscard]] double worst_gain(double bound) const noexcept;
};

/// The test of false-alarm probability α.
[[nodiscard]] ChiSquaredTest chi_squared_test(double false_alarm, double degrees) noexcept;

}  // namespace surefix::raim
