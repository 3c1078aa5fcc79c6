// Tails of the distributions that thresholds and p-values come from. Upper tails are computed as
// such (Boost.Math complements), never as 1 − cdf: at a risk of 1e-11 the difference is noise.
#pragma once

namespace surefix {

/// Normal quantile K with P(|X| > K) = risk, 0 < risk < 1 (two-sided).
[[nodiscard]] double normal_two_sided(double risk) noexcept;

/// P(X > x) of the χ² distribution with `degrees` > 0 degrees of freedom, x ≥ 0.
[[nodiscard]] double chi_squared_tail(double x, double degrees) noexcept;

/// x with P(X > x) = probability, 0 < probability < 1.
[[nodiscard]] double chi_squared_threshold(double probability, double degrees) noexcept;

}  // namespace surefix
