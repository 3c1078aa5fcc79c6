#include "surefix/core/distributions.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <limits>

namespace surefix {
namespace {

// No exceptions: a value outside the domain gives NaN. Double in, double inside: Boost's promotion
// to long double costs 3 × the time for digits that nobody reads.
using Policy = boost::math::policies::policy<
    boost::math::policies::domain_error<boost::math::policies::ignore_error>,
    boost::math::policies::pole_error<boost::math::policies::ignore_error>,
    boost::math::policies::overflow_error<boost::math::policies::ignore_error>,
    boost::math::policies::evaluation_error<boost::math::policies::ignore_error>,
    boost::math::policies::rounding_error<boost::math::policies::ignore_error>,
    boost::math::policies::promote_double<false>>;
using Normal = boost::math::normal_distribution<double, Policy>;
using ChiSquared = boost::math::chi_squared_distribution<double, Policy>;
using Noncentral = boost::math::non_central_chi_squared_distribution<double, Policy>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double far_out = 1e-30;  // below, Boost loses digits of lower tails and densities
constexpr double largest_noncentrality = 1e6;  // Boost's series grow with its root: 0.2 ms here

double square(double x) noexcept { return x * x; }

/// P(side (X − x) > 0) of a noncentral χ² so far out that √(X + (k − 1)/2) is normal with unit
/// variance but for 1e-3.
double far_tail(double x, double degrees, double noncentrality, double side) noexcept {
  if (!(x >= 0.0 && degrees > 0.0)) return nan;
  const double shift = 0.5 * (degrees - 1.0);
  return normal_tail(side *
                     (std::sqrt(std::max(x - shift, 0.0)) - std::sqrt(noncentrality + shift)));
}

/// Σ_j Poisson(j; h) y^(b+j−1) e^(−y)/Γ(b + j) S_j, from its largest term: so far out Boost's
/// series, which begin at the largest weight, meet only terms that underflow there. S_j = 1, or, if
/// `cumulated`, 1 + y/(b + j) S_{j+1}, which makes of the other factor the incomplete gamma
/// function P(b + j − 1, y).
double far_sum(double h, double y, double b, bool cumulated) noexcept {
  const auto log_gamma = [](double x) { return boost::math::lgamma(x, Policy()); };
  const double product = h * y;
  const auto ratio = [&](double j) { return product / ((j + 1.0) * (b + j)); };  // of term j + 1
  const double from =
      std::floor(std::max(0.0, 0.5 * (std::sqrt(square(b - 1.0) + 4.0 * product) - b - 1.0)));
  double j = from, weight = 1.0, S = 1.0, sum = 0.0;
  for (; weight * ratio(j) > 1e-17; ++j) weight *= ratio(j);
  if (cumulated)
    for (double i = j, t = 1.0; t > 1e-17 * S; ++i) S += t *= y / (b + i);
  for (;; --j) {
    const double term = weight * S;
    sum += term;
    if (j == 0.0 || (j < from && term < 1e-17 * sum)) break;
    if (cumulated) S = 1.0 + y / (b + j - 1.0) * S;
    weight /= ratio(j - 1.0);
  }
  return sum * std::exp(from * std::log(h) - h - log_gamma(from + 1.0) +
                        (b + from - 1.0) * std::log(y) - y - log_gamma(b + from));
}

}  // namespace

double normal_tail(double x) noexcept { return 0.5 * std::erfc(x * 0.70710678118654752440); }

double normal_one_sided(double probability) noexcept {
  return boost::math::quantile(boost::math::complement(Normal(), probability));
}

double normal_two_sided(double risk) noexcept {
  return boost::math::quantile(boost::math::complement(Normal(), 0.5 * risk));
}

double chi_squared_tail(double x, double degrees) noexcept {
  if (x == infinity) return 0.0;
  return boost::math::cdf(boost::math::complement(ChiSquared(degrees), x));
}

double chi_squared_threshold(double probability, double degrees) noexcept {
  return boost::math::quantile(boost::math::complement(ChiSquared(degrees), probability));
}

double noncentral_chi_squared_tail(double x, double degrees, double noncentrality) noexcept {
  if (x == infinity) return 0.0;
  if (x == 0.0 && degrees > 0.0 && noncentrality >= 0.0) return 1.0;
  if (noncentrality > largest_noncentrality) return far_tail(x, degrees, noncentrality, 1.0);
  return boost::math::cdf(boost::math::complement(Noncentral(degrees, noncentrality), x));
}

double noncentral_chi_squared_cdf(double x, double degrees, double noncentrality) noexcept {
  if (x == infinity) return 1.0;
  if (noncentrality > largest_noncentrality) return far_tail(x, degrees, noncentrality, -1.0);
  const double p = boost::math::cdf(Noncentral(degrees, noncentrality), x);
  if (!(p < far_out && x > 0.0 && noncentrality > 0.0)) return p;
  return far_sum(0.5 * noncentrality, 0.5 * x, 0.5 * degrees + 1.0, true);
}

double noncentral_chi_squared_density(double x, double degrees, double noncentrality) noexcept {
  const double p = boost::math::pdf(Noncentral(degrees, noncentrality), x);
  const bool sums = x > 0.0 && noncentrality > 0.0 && noncentrality <= largest_noncentrality;
  if (!(p < far_out && sums)) return p;
  return 0.5 * far_sum(0.5 * noncentrality, 0.5 * x, 0.5 * degrees, false);
}

double noncentrality_for(double missed, double x, double degrees) noexcept {
  if (!(missed > 0.0 && missed < 1.0)) return nan;
  if (missed >= boost::math::cdf(ChiSquared(degrees), x)) return 0.0;
  return Noncentral::find_non_centrality(degrees, x, missed);
}

}  // namespace surefix
