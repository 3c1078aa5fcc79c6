// Alert limits of a one-dimensional Gaussian mixture (Bilenne 2004, sec. 3.2), exact on the
// mixture: replacing it by one Gaussian of its mean and variance under-reports the risk by orders
// of magnitude. Tails are sums of erfc, never 1 − Φ, so that risks of 1e-15 and far below keep
// their digits.
//
// A tail probability here is that of one side. The interval that holds the truth with risk ρ lies
// between the two limits at ρ/2 each.
#pragma once

#include <cstddef>
#include <cstdint>

namespace surefix::robust {

/// Σ weight_i N(mean_i, sigma_i²), a view. Weights need not sum to one: what is missing is for the
/// caller to account for. sigma_i = 0 is a point mass.
struct TailMixture {
  const double* weight;  ///< ≥ 0
  const double* mean;    ///< [unit of the state]
  const double* sigma;   ///< ≥ 0 [unit of the state]
  std::size_t count;
};

/// Σ weight_i P(X_i > x), with its relative precision however small.
[[nodiscard]] double upper_tail(const TailMixture& mixture, double x) noexcept;

/// Σ weight_i P(X_i < x).
[[nodiscard]] double lower_tail(const TailMixture& mixture, double x) noexcept;

/// The smallest U with upper_tail(U) ≤ tail; what rounding and speed take away, 1e-12 of the tail
/// and a few units in the last place of U, is taken on the safe side.
///   −infinity  the weights do not sum to more than `tail` (nor do those of an empty mixture)
///   +infinity  not available: tail ≤ 0 or NaN; a weight, mean or sigma that is NaN, infinite or
///              out of its range, whatever the component's weight
[[nodiscard]] double upper_limit(const TailMixture& mixture, double tail) noexcept;

/// The largest L with lower_tail(L) ≤ tail: the upper limit of the mirrored mixture, mirrored, with
/// the opposite infinities.
[[nodiscard]] double lower_limit(const TailMixture& mixture, double tail) noexcept;

/// Which side a limit is asked for; the whole risk belongs to it.
enum class Sides : std::uint8_t { both, lower, upper };

struct AlertLimits {
  double lower;  ///< −∞: none was asked for, or none is available
  double upper;  ///< +∞: as above
};

/// Limits at `risk`: half of it on each side, or all of it on one.
[[nodiscard]] AlertLimits find_limits(const TailMixture& mixture, double risk,
                                      Sides sides) noexcept;

/// 1 − (1 − risk)^(1/exposures): the risk per estimate that leaves `risk` over a number of
/// effective independent exposures, those in one hour for a risk per hour. NaN, for which no limit
/// is available, unless 0 ≤ risk ≤ 1 and exposures > 0.
[[nodiscard]] double per_estimate(double risk, double exposures) noexcept;

}  // namespace surefix::robust
