#include "surefix/raim/separation.hpp"

#include <algorithm>
#include <limits>

#include "surefix/core/distributions.hpp"

namespace surefix::raim {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double unseen = 1e-10;   // of an eigenvalue of (I − P)_JJ: the residual shows nothing
constexpr double harmless = 1e-8;  // of the effect in σ_l: rounding

/// Hypotheses of one epoch: T_J, σ_J and how many of them have one satellite.
class Hypotheses {
 public:
  void add(const SetSolution& set, double sigma, double K, bool single) noexcept {
    const auto i = static_cast<std::size_t>(count_++);
    threshold_[i] = K * std::sqrt(set.variance);
    sigma_[i] = std::sqrt(sigma * sigma + set.variance);
    if (single) ++singles_;
  }

  /// Σ_J, and the fault-free term.
  struct Tail {
    const Hypotheses& sets;
    double sigma, prior, bent;
    TailValue operator()(double x) const noexcept {
      const TailValue none = gaussian_tail(x - bent * sigma, sigma);
      TailValue sum{2.0 * none.probability, 2.0 * none.density};
      double p = prior;
      for (int k = 0; k < sets.count_; ++k) {
        if (k == sets.singles_) p = prior * prior;
        const auto i = static_cast<std::size_t>(k);
        const double beyond = x - sets.threshold_[i] - bent * sets.sigma_[i];
        if (beyond <= 0.0) {  // 2 Q ≥ 1
          sum.probability += p;
          continue;
        }
        const TailValue tail = gaussian_tail(beyond, sets.sigma_[i]);
        sum.probability += p * 2.0 * tail.probability;
        sum.density += p * 2.0 * tail.density;
      }
      return sum;
    }
  };

  /// The PL of `budget` > 0. If every term is at 1/(count + 1) of it, so is the sum; if the largest
  /// is at all of it, the sum is not below.
  [[nodiscard]] double protection(double sigma, double prior, double budget,
                                  double bent) const noexcept {
    const double part = budget / (count_ + 1);
    double low = (beyond(budget) + bent) * sigma, high = (beyond(part) + bent) * sigma;
    const double low_1 = beyond(budget / prior), high_1 = beyond(part / prior);
    const double low_2 = beyond(budget / (prior * prior)), high_2 = beyond(part / (prior * prior));
    for (int k = 0; k < count_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      low = std::max(low, threshold_[i] + ((k < singles_ ? low_1 : low_2) + bent) * sigma_[i]);
      high = std::max(high, threshold_[i] + ((k < singles_ ? high_1 : high_2) + bent) * sigma_[i]);
    }
    return tail_root(Tail{*this, sigma, prior, bent}, budget, low, high);
  }

 private:
  /// K of 2 Q(K) = p; −∞ for a term that needs no limit.
  static double beyond(double p) noexcept { return p < 1.0 ? normal_two_sided(p) : -infinity; }

  static constexpr std::size_t most = max_satellites * (max_satellites + 1) / 2;
  int count_ = 0, singles_ = 0;
  std::array<double, most> threshold_, sigma_;
};

}  // namespace

SetSolution without(const Geometry& g, const double* r, int i) noexcept {
  const double effect = g.effect(i), seen = g.seen(i, i);
  if (seen > unseen)
    return {SetSolution::Kind::seen, -effect * r[i] / seen, effect * effect / seen};
  const bool none = std::abs(effect) <= harmless * g.sigma();
  return {none ? SetSolution::Kind::harmless : SetSolution::Kind::blind};
}

SetSolution without(const Geometry& g, const double* r, int i, int j) noexcept {
  const double a = g.seen(i, i), b = g.seen(j, j), c = g.seen(i, j);
  // By the eigenvectors (cos, sin) and (−sin, cos): one of them may be invisible, as an error that
  // two satellites share is when they are all that their system has.
  const double half = 0.5 * std::atan2(2.0 * c, a - b);
  const double cosine = std::cos(half), sine = std::sin(half);
  const double middle = 0.5 * (a + b), spread = std::hypot(0.5 * (a - b), c);
  const double effects[2] = {cosine * g.effect(i) + sine * g.effect(j),
                             cosine * g.effect(j) - sine * g.effect(i)};
  const double residual[2] = {cosine * r[i] + sine * r[j], cosine * r[j] - sine * r[i]};
  const double eigenvalue[2] = {middle + spread, middle - spread};
  SetSolution out{SetSolution::Kind::harmless};
  for (int k = 0; k < 2; ++k) {
    if (eigenvalue[k] > unseen) {
      out.kind = SetSolution::Kind::seen;
      out.shift -= effects[k] * residual[k] / eigenvalue[k];
      out.variance += effects[k] * effects[k] / eigenvalue[k];
    } else if (std::abs(effects[k]) > harmless * g.sigma()) {
      return {SetSolution::Kind::blind};
    }
  }
  return out;
}

Separation separate(const Geometry& g, const double* r, const TangentError& error,
                    const MonitorSettings& settings, const MonitorTables& tables,
                    double share) noexcept {
  const int n = g.size();
  const double K = tables.separation(n), sigma = g.sigma(), prior = settings.fault_probability;
  double budget = share;
  Separation out;
  Hypotheses hypotheses;
  const auto take = [&](const SetSolution& set, bool single) {
    if (set.kind == SetSolution::Kind::blind) budget -= single ? prior : prior * prior;
    if (set.kind != SetSolution::Kind::seen) return;
    if (std::abs(set.shift) > K * std::sqrt(set.variance)) out.alarm = true;
    hypotheses.add(set, sigma, K, single);
  };
  for (int i = 0; i < n; ++i) take(without(g, r, i), true);
  if (settings.max_faults > 1)
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j) take(without(g, r, i, j), false);
  out.protection = infinity;
  if (!(budget > 0.0)) return out;
  out.protection = within(settings.interval, [&](double half) {
    return hypotheses.protection(sigma, prior, budget, error.over(half).whole);
  });
  return out;
}

}  // namespace surefix::raim
