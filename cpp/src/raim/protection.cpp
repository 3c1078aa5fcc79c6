#include "surefix/raim/protection.hpp"

#include <cmath>
#include <limits>

#include "surefix/core/distributions.hpp"
#include "surefix/raim/tail_root.hpp"

namespace surefix::raim {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double unseen = 1e-10;   // of 1 − P_ii: the residual shows nothing
constexpr double harmless = 1e-8;  // of the effect in σ_l: rounding

/// P(|N(μ, σ²)| > half) as a function of half − μ, for a given half (`fixed`) …
struct AtHalf {
  double half, sigma;
  TailValue operator()(double rest) const noexcept {
    const TailValue near = gaussian_tail(rest, sigma),
                    far = gaussian_tail(2.0 * half - rest, sigma);
    return {near.probability + far.probability, near.density - far.density};
  }
};
/// … and as a function of half, for a given μ.
struct AtShift {
  double shift, sigma;
  TailValue operator()(double half) const noexcept {
    const TailValue near = gaussian_tail(half - shift, sigma);
    const TailValue far = gaussian_tail(half + shift, sigma);
    return {near.probability + far.probability, near.density + far.density};
  }
};

/// μ*: the largest shift with P(|l̂ − l| > L/2) p_f ≤ p_r.
double critical_shift(double sigma, const MonitorSettings& s,
                      const MonitorTables& tables) noexcept {
  const double tolerated = s.risk / s.fault_probability, half = 0.5 * s.length;
  if (tolerated >= 1.0) return infinity;
  const AtHalf tail{half, sigma};
  if (tail(half).probability > tolerated) return 0.0;
  const double least = std::min(tables.tolerated() * sigma, half);
  return half - tail_root(tail, tolerated, least, half);
}

}  // namespace

SnapshotIntegrity snapshot_integrity(const Geometry& geometry, const MonitorSettings& settings,
                                     const MonitorTables& tables) noexcept {
  SnapshotIntegrity out;
  const ChiSquaredTest& test = tables.test(geometry.degrees());
  const double shift = critical_shift(geometry.sigma(), settings, tables);
  out.p_star = out.slope = 0.0;
  out.noncentrality = infinity;
  for (int i = 0; i < geometry.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double effect = std::abs(geometry.effect(i)), seen = geometry.seen(i, i);
    out.critical_bias[k] = infinity;
    out.missed[k] = 0.0;
    if (effect <= harmless * geometry.sigma()) continue;
    const double slope = seen > unseen ? effect / std::sqrt(seen) : infinity;
    out.slope = std::max(out.slope, slope);
    if (shift == infinity) continue;
    const double root = slope < infinity ? shift / slope : 0.0;  // √λ of v*
    out.critical_bias[k] = shift / effect / geometry.clocks().root_weight(i);
    out.missed[k] = test.missed(root * root);
    out.p_star = std::max(out.p_star, out.missed[k]);
    out.noncentrality = std::min(out.noncentrality, root * root);
  }
  return out;
}

double snapshot_protection(const Geometry& geometry, double slope,
                           const TangentError::Bounds& bounds, const MonitorSettings& settings,
                           const MonitorTables& tables) noexcept {
  const double sigma = geometry.sigma(), tolerated = settings.risk / settings.fault_probability;
  const double off = sigma * bounds.whole;  // l̂ by the bend alone
  const double healthy = off + normal_two_sided(settings.risk) * sigma;
  if (slope == 0.0 || tolerated >= 1.0) return healthy;
  const double shift = slope * (tables.detected(geometry.degrees()) + bounds.parity);
  if (!(shift < infinity)) return infinity;
  const double low = shift + tables.tolerated() * sigma;
  const double high = shift + normal_one_sided(0.5 * tolerated) * sigma;
  const double faulty = tail_root(AtShift{shift, sigma}, tolerated, std::max(low, 0.0), high);
  return std::max(healthy, off + faulty);
}

}  // namespace surefix::raim
