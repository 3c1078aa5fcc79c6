// Tails of the distributions that thresholds and p-values come from. Upper tails are computed as
// such (Boost.Math complements), never as 1 − cdf: at a risk of 1e-11 the difference is noise.
// Outside their domains all of them give NaN.
#pragma once

namespace surefix {

/// P(X > x) of the standard normal distribution.
[[nodiscard]] double normal_tail(double x) noexcept;

/// Normal quantile K with P(X > K) = probability, 0 < probability < 1 (one-sided).
[[nodiscard]] double normal_one_sided(double probability) noexcept;

/// Normal quantile K with P(|X| > K) = risk, 0 < risk < 1 (two-sided).
[[nodiscard]] double normal_two_sided(double risk) noexcept;

/// P(X > x) of the χ² distribution with `degrees` > 0 degrees of freedom, x ≥ 0.
[[nodiscard]] double chi_squared_tail(double x, double degrees) noexcept;

/// x with P(X > x) = probability, 0 < probability < 1.
[[nodiscard]] double chi_squared_threshold(double probability, double degrees) noexcept;

/// P(X > x) of the noncentral χ² distribution, noncentrality ≥ 0; beyond 1e6 of the latter by a
/// normal approximation.
[[nodiscard]] double noncentral_chi_squared_tail(double x, double degrees,
                                                 double noncentrality) noexcept;

/// P(X ≤ x) of it, with its relative precision however small: what a test at threshold x misses.
[[nodiscard]] double noncentral_chi_squared_cdf(double x, double degrees,
                                                double noncentrality) noexcept;

/// Its density at x (Lacresse, Grall & Nikiforov 2005, below eq. 6).
[[nodiscard]] double noncentral_chi_squared_density(double x, double degrees,
                                                    double noncentrality) noexcept;

/// The noncentrality at which P(X ≤ x) = missed; 0 where that is more than the central
/// distribution's: nothing needs to be there for so many to be missed.
[[nodiscard]] double noncentrality_for(double missed, double x, double degrees) noexcept;

}  // namespace surefix
