// W6 by hand: Boost.Math in plain loops, in double without promotion.
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <cstddef>

namespace {
namespace policies = boost::math::policies;
using Policy = policies::policy<policies::promote_double<false>>;
using Central = boost::math::chi_squared_distribution<double, Policy>;
using Noncentral = boost::math::non_central_chi_squared_distribution<double, Policy>;
}  // namespace

extern "C" {

/// P(X ≤ x) for every x, degrees and noncentrality.
void w6_cdf(const double* x, const double* degrees, const double* lambda, std::size_t n,
            double* out) {
  for (std::size_t i = 0; i < n; ++i)
    out[i] = boost::math::cdf(Noncentral(degrees[i], lambda[i]), x[i]);
}

/// x with P(X > x) = p, central.
void w6_quantile(const double* p, const double* degrees, std::size_t n, double* out) {
  for (std::size_t i = 0; i < n; ++i)
    out[i] = boost::math::quantile(boost::math::complement(Central(degrees[i]), p[i]));
}

/// The noncentrality with P(X ≤ x) = p.
void w6_noncentrality(const double* p, const double* x, const double* degrees, std::size_t n,
                      double* out) {
  for (std::size_t i = 0; i < n; ++i)
    out[i] = Noncentral::find_non_centrality(degrees[i], x[i], p[i]);
}
}
