// Four hypotheses of the tree per measurement, side by side.
#pragma once

#include <limits>

#include "surefix/core/predict.hpp"
#include "surefix/core/update.hpp"
#include "surefix/desync/measurement.hpp"
#include "surefix/robust/components.hpp"
#include "surefix/robust/fault_system.hpp"

namespace surefix::robust {

template <class System>
struct TreeNode {
  static constexpr int lanes = 4;
  using Lane = Pack<lanes>;
  using Belief = Gaussian<System::size, Lane, System::max_size>;
  static constexpr double two_pi = 6.28318530717958647693;

  Belief belief;
  Lane log_weight;  // without the squares and the product
  Lane squares;     // Σ ν²/S
  Lane product;     // of the 2πS that are not in the log-weight

  /// Lane `l` from component `c`.
  void load(Eigen::Index l, const Components& from, std::size_t c) noexcept {
    const int n = from.state_size();
    for (int j = 0; j < n; ++j) {
      belief.x(j)(l) = from.x(c)[j];
      for (int i = 0; i < n; ++i) belief.P(i, j)(l) = from.P(c)[j * n + i];
    }
    log_weight(l) = from.log_weight(c);
    squares(l) = 0.0;
    product(l) = 1.0;
  }

  /// Lane `to` from lane `l` of another.
  void copy(Eigen::Index to, const TreeNode& from, Eigen::Index l) noexcept {
    const int n = belief.size();
    for (int j = 0; j < n; ++j) {
      belief.x(j)(to) = from.belief.x(j)(l);
      for (int i = 0; i < n; ++i) belief.P(i, j)(to) = from.belief.P(i, j)(l);
    }
    log_weight(to) = from.log_weight(l);
    squares(to) = from.squares(l);
    product(to) = from.product(l);
  }

  template <class Leg>
  SUREFIX_INLINE void move(const Leg& leg) noexcept {
    if (leg.elapsed != 0) predict(belief, leg.transition);
  }

  /// Updates the first `healthy` lanes; the others, if any, hold the measurement for an outlier.
  /// False if a variance overflows.
  [[nodiscard]] SUREFIX_INLINE bool absorb(const System& system, const desync::Measurement& m,
                                           double variance, std::size_t healthy,
                                           double log_healthy) noexcept {
    log_weight += log_healthy;
    if (healthy >= lanes) return absorb(system, m, variance, Lane(1.0), Lane(two_pi));
    Lane r = Lane(variance), used = Lane(1.0), scale = Lane(two_pi);
    for (auto l = static_cast<Eigen::Index>(healthy); l < lanes; ++l) {
      r(l) = removed_variance;
      used(l) = 0.0;
      scale(l) = 1.0 / removed_variance;  // so that log S counts for nothing
      log_weight(l) -= log_healthy;
    }
    return absorb(system, m, r, used, scale);
  }

  /// Puts the product into the log-weight.
  void settle() noexcept {
    // One by one: the C library's logarithm is faster than Eigen's of two lanes.
    for (Eigen::Index l = 0; l < lanes; ++l) log_weight(l) -= 0.5 * std::log(product(l));
    product = Lane(1.0);
  }

  /// The first `count` lanes, settled, as components from the h-th on; a hypothesis that overflowed
  /// has no weight. Nothing is called: what a call would leave in memory stays in registers.
  SUREFIX_INLINE void store(Components& to, std::size_t h, std::size_t count) const noexcept {
    const int n = belief.size();
    Lane sum = squares;
    loop<System::size>(n, [&](int j) SUREFIX_LAMBDA { sum += belief.x(j) + belief.P(j, j); });
    const Lane valid = sum * 0.0, weight = log_weight - 0.5 * squares;
    double* x = to.x(h);
    double* P = to.P(h);
    for (std::size_t l = 0; l < count; ++l, x += n, P += n * n) {
      const auto i = static_cast<Eigen::Index>(l);
      to.log_weight(h + l) = valid(i) == 0.0 ? weight(i) : -std::numeric_limits<double>::infinity();
      to.squares(h + l) = squares(i);
      loop<System::size>(n, [&](int c) SUREFIX_LAMBDA {
        x[c] = belief.x(c)(i);
        loop<System::size>(n, [&](int r) SUREFIX_LAMBDA { P[c * n + r] = belief.P(r, c)(i); });
      });
    }
  }

 private:
  template <class Variance>
  [[nodiscard]] SUREFIX_INLINE bool absorb(const System& system, const desync::Measurement& m,
                                           const Variance& r, const Lane& used,
                                           const Lane& scale) noexcept {
    const auto reading = system.read(m.sensor, belief.x);
    const Lane innovation = m.value - reading.predicted;
    Innovation<Belief> out;
    const bool updated = system.with_row(m.sensor, reading.at, belief,
                                         [&](const auto& row, auto& value) SUREFIX_LAMBDA {
                                           return update(value, row, r, innovation, out);
                                         });
    if (!updated) return false;
    squares += used * (innovation.square() / out.variance);
    const Lane before = product, factor = out.variance * scale;
    product *= factor;
    if (within(product, 1e-100, 1e100)) return true;
    product = before;
    settle();
    product = factor;  // whose product may be no normal number
    settle();
    return true;
  }
};

}  // namespace surefix::robust
