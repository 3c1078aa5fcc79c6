#include "surefix/core/distributions.hpp"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
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
    boost::math::policies::promote_double<false>>;
using Normal = boost::math::normal_distribution<double, Policy>;
using ChiSquared = boost::math::chi_squared_distribution<double, Policy>;

}  // namespace

double normal_two_sided(double risk) noexcept {
  return boost::math::quantile(boost::math::complement(Normal(), 0.5 * risk));
}

double chi_squared_tail(double x, double degrees) noexcept {
  if (x == std::numeric_limits<double>::infinity()) return 0.0;
  return boost::math::cdf(boost::math::complement(ChiSquared(degrees), x));
}

double chi_squared_threshold(double probability, double degrees) noexcept {
  return boost::math::quantile(boost::math::complement(ChiSquared(degrees), probability));
}

}  // namespace surefix
