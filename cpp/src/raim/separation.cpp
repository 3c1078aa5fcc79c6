#include "surefix/raim/separation.hpp"

#include <algorithm>
#include <limits>

#include "surefix/core/distributions.hpp"

namespace surefix::raim {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double unseen = 1e-10;   // of an eigenvalue of (I − P)_JJ: the residual shows nothing
constexpr double harmless = 1e-8;  // of the effect in σ_l: rounding

/// K of 2 Q(K) = p; −∞ for a term that needs no limit.
double beyond(double p) noexcept { return p < 1.0 ? normal_two_sided(p) : -infinity; }

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

Separation::Separation(const Geometry& g, const double* r, const MonitorSettings& settings,
                       const MonitorTables& tables) noexcept
    : sigma_(g.sigma()), prior_(settings.fault_probability) {
  const int n = g.size();
  const double K = tables.separation(n);
  if (settings.max_faults > 0)
    for (int i = 0; i < n; ++i) add(without(g, r, i), K, true);
  if (settings.max_faults > 1)
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j) add(without(g, r, i, j), K, false);
}

void Separation::add(const SetSolution& set, double K, bool single) noexcept {
  if (set.kind == SetSolution::Kind::blind) blind_ += single ? prior_ : prior_ * prior_;
  if (set.kind != SetSolution::Kind::seen) return;
  const auto i = static_cast<std::size_t>(count_++);
  threshold_[i] = K * std::sqrt(set.variance);
  set_sigma_[i] = std::sqrt(sigma_ * sigma_ + set.variance);
  if (single) ++singles_;
  if (std::abs(set.shift) > threshold_[i]) alarm_ = true;
}

TailValue Separation::tail(double x, double bent) const noexcept {
  const TailValue none = gaussian_tail(x - bent * sigma_, sigma_);
  TailValue sum{2.0 * none.probability, 2.0 * none.density};
  double p = prior_;
  for (int k = 0; k < count_; ++k) {
    if (k == singles_) p = prior_ * prior_;
    const auto i = static_cast<std::size_t>(k);
    const double left = x - threshold_[i] - bent * set_sigma_[i];
    if (left <= 0.0) {  // 2 Q ≥ 1
      sum.probability += p;
      continue;
    }
    const TailValue term = gaussian_tail(left, set_sigma_[i]);
    sum.probability += p * 2.0 * term.probability;
    sum.density += p * 2.0 * term.density;
  }
  return sum;
}

/// The PL of `budget` > 0. If every term is at 1/(count + 1) of it, so is the sum; if the largest
/// is at all of it, the sum is not below.
double Separation::level(double budget, double bent) const noexcept {
  const double part = budget / (count_ + 1);
  double low = (beyond(budget) + bent) * sigma_, high = (beyond(part) + bent) * sigma_;
  double p = prior_, low_K = beyond(budget / p), high_K = beyond(part / p);
  for (int k = 0; k < count_; ++k) {
    if (k == singles_) p = prior_ * prior_, low_K = beyond(budget / p), high_K = beyond(part / p);
    const auto i = static_cast<std::size_t>(k);
    low = std::max(low, threshold_[i] + (low_K + bent) * set_sigma_[i]);
    high = std::max(high, threshold_[i] + (high_K + bent) * set_sigma_[i]);
  }
  return tail_root([&](double x) noexcept { return tail(x, bent); }, budget, low, high);
}

double Separation::protection(const TangentError& error, double share) const noexcept {
  const double budget = share - blind_;
  if (!(budget > 0.0)) return infinity;
  return error.within(
      [&](const TangentError::Bounds& bounds) { return level(budget, bounds.whole); });
}

}  // namespace surefix::raim
