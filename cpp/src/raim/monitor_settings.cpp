#include "surefix/raim/monitor_settings.hpp"

#include <cmath>
#include <limits>

#include "surefix/core/distributions.hpp"

namespace surefix::raim {
namespace {

bool probability(double p) noexcept { return p > 0.0 && p < 1.0; }

/// n over k.
double choose(int n, int k) noexcept {
  double out = 1.0;
  for (int i = 0; i < k; ++i) out = out * (n - i) / (i + 1);
  return std::round(out);
}

}  // namespace

ConfigStatus MonitorSettings::check() const noexcept {
  if (!std::isfinite(length) || !std::isfinite(interval) || !std::isfinite(rotation))
    return ConfigStatus::not_finite;
  if (!(length > 0.0 && interval > 0.0)) return ConfigStatus::not_positive;
  if (!probability(false_alarm) || !probability(missed) || !probability(fault_probability))
    return ConfigStatus::prior;
  if (!probability(risk)) return ConfigStatus::risk;
  const bool sets = max_faults >= 0 && max_faults <= 2 && max_excluded >= 0;
  return sets && max_excluded <= max_set ? ConfigStatus::ok : ConfigStatus::wrong_size;
}

MonitorTables::MonitorTables(const MonitorSettings& settings) noexcept {
  const double p = settings.fault_probability;
  for (int n = 1; n <= max_satellites; ++n) {
    const auto i = static_cast<std::size_t>(n);
    test_[i] = chi_squared_test(settings.false_alarm, n);
    detected_[i] = std::sqrt(noncentrality_for(settings.missed, test_[i].threshold, n));
    double sets = 0.0, outcomes = 0.0;
    for (int k = 1; k <= settings.max_faults; ++k) sets += choose(n, k);
    for (int k = 1; k <= settings.max_excluded; ++k) outcomes += choose(n, k);
    separation_[i] = sets > 0.0 ? normal_two_sided(settings.false_alarm / sets) : 0.0;
    double unmonitored = 0.0;
    for (int k = n; k > settings.max_faults; --k)
      unmonitored += choose(n, k) * std::pow(p, k) * std::pow(1.0 - p, n - k);
    const double covered = settings.risk - unmonitored;
    share_none_[i] = outcomes > 0.0 ? 0.5 * covered : covered;
    share_set_[i] = outcomes > 0.0 ? 0.5 * covered / outcomes : 0.0;
  }
  const double tolerated = settings.risk / p;
  tolerated_ =
      tolerated < 1.0 ? normal_one_sided(tolerated) : -std::numeric_limits<double>::infinity();
}

}  // namespace surefix::raim
