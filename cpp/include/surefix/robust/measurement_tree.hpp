// The hypotheses per measurement: each measurement of a step is healthy or an outlier on its own,
// 2^N of them. The tree grows level by level in the order of time, so that every new hypothesis
// costs one scalar update, and four of them go side by side.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "surefix/core/predict.hpp"
#include "surefix/core/update.hpp"
#include "surefix/robust/components.hpp"
#include "surefix/robust/step_plan.hpp"

namespace surefix::robust {

/// How an outlier of one sensor is weighed against a healthy measurement.
struct OutlierPrior {
  double log_healthy = 0.0;  ///< log (1 − p)
  double log_outlier = 0.0;  ///< log p − log span; −∞ where the sensor has no outliers
};

template <class System>
class MeasurementTree {
  static constexpr int lanes = 4;
  using Lane = Pack<lanes>;
  using Belief = Gaussian<System::size, Lane, System::max_size>;

 public:
  MeasurementTree() = default;
  /// Room for `capacity` hypotheses at a time, a multiple of 4 and at least 8.
  MeasurementTree(const System& system, std::size_t capacity) : nodes_(capacity / lanes) {
    const int n = system.state_size();
    for (Node& node : nodes_) {
      node.belief.x.resize(n);
      node.belief.P.resize(n, n);
    }
    faults_.resize(capacity);
    weight_.resize(capacity);
    order_.resize(capacity);
  }

  /// Starts from the components of a mixture; their bits say that nothing is faulty.
  void start(const Components& from) noexcept {
    count_ = from.count();
    const int n = from.state_size();
    for (std::size_t h = 0; h < padded(); ++h) {
      const std::size_t c = std::min(h, count_ - 1);
      Node& node = nodes_[h / lanes];
      const auto l = static_cast<Eigen::Index>(h % lanes);
      for (int j = 0; j < n; ++j) {
        node.belief.x(j)(l) = from.x(c)[j];
        for (int i = 0; i < n; ++i) node.belief.P(i, j)(l) = from.P(c)[j * n + i];
      }
      node.log_weight(l) = from.log_weight(c);
      node.squares(l) = 0.0;
      node.product(l) = 1.0;
      faults_[h] = 0;
    }
  }

  /// Takes a measurement after its leg; `bit` ≤ 63 is set in the hypotheses that hold it for an
  /// outlier. Where there is no room for both children of all, the lightest go: their mass is
  /// added to `lost`. False if a variance overflows.
  template <class Leg>
  [[nodiscard]] bool grow(const System& system, const Leg& leg, const Measurement& m, int bit,
                          const OutlierPrior& prior, double& lost) noexcept {
    const double sigma = system.sensor(m.sensor).sigma, variance = sigma * sigma;
    const bool outliers = prior.log_outlier > -std::numeric_limits<double>::infinity();
    if (outliers && 2 * padded() > faults_.size()) cut(faults_.size() / 2, lost);
    const std::size_t parents = count_;
    const bool whole = parents % lanes == 0;  // then children have packs of their own
    if (outliers && !whole) {
      move(leg);
      add_children(prior.log_outlier);
    }
    for (std::size_t k = 0; k < (parents + lanes - 1) / lanes; ++k) {
      Node& node = nodes_[k];
      if (!outliers || whole) move(node, leg);
      if (outliers && whole) {
        Node& child = nodes_[parents / lanes + k];
        child = node;
        child.log_weight += prior.log_outlier;
      }
      node.log_weight += prior.log_healthy;
      if (!absorb(system, node, m, variance, parents - k * lanes, prior.log_healthy)) return false;
    }
    if (!outliers) return true;
    for (std::size_t h = 0; h < parents; ++h)
      faults_[parents + h] = faults_[h] | std::uint64_t{1} << bit;
    count_ = 2 * parents;
    return true;
  }

  /// Goes on to the estimate.
  template <class Leg>
  void move(const Leg& leg) noexcept {
    for (std::size_t k = 0; k < padded() / lanes; ++k) move(nodes_[k], leg);
  }

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] std::uint64_t faults(std::size_t h) const noexcept { return faults_[h]; }
  /// The leaves as components, log-weights not normalised; `to` has room for `count`.
  void store(Components& to) const noexcept {
    to.resize(count_);
    for (std::size_t h = 0; h < count_; h += lanes) store(nodes_[h / lanes], to, h);
  }

 private:
  struct Node {
    Belief belief;
    Lane log_weight;  // without the squares and the product
    Lane squares;     // Σ ν²/S
    Lane product;     // of the 2πS that are not in the log-weight
  };

  [[nodiscard]] std::size_t padded() const noexcept { return (count_ + lanes - 1) / lanes * lanes; }

  template <class Leg>
  SUREFIX_INLINE static void move(Node& node, const Leg& leg) noexcept {
    if (leg.elapsed != 0) predict(node.belief, leg.transition);
  }

  /// Updates the first `healthy` lanes; the others, if any, hold the measurement for an outlier.
  [[nodiscard]] SUREFIX_INLINE bool absorb(const System& system, Node& node, const Measurement& m,
                                           double variance, std::size_t healthy,
                                           double log_healthy) noexcept {
    if (healthy >= lanes) return absorb(system, node, m, variance, Lane(1.0), Lane(two_pi));
    Lane r = Lane(variance), used = Lane(1.0), scale = Lane(two_pi);
    for (auto l = static_cast<Eigen::Index>(healthy); l < lanes; ++l) {
      r(l) = removed_variance;
      used(l) = 0.0;
      scale(l) = 1.0 / removed_variance;  // so that log S counts for nothing
      node.log_weight(l) -= log_healthy;
    }
    return absorb(system, node, m, r, used, scale);
  }

  template <class Variance>
  [[nodiscard]] SUREFIX_INLINE bool absorb(const System& system, Node& node, const Measurement& m,
                                           const Variance& r, const Lane& used,
                                           const Lane& scale) noexcept {
    const auto reading = system.read(m.sensor, node.belief.x);
    const Lane innovation = m.value - reading.predicted;
    Innovation<Belief> out;
    const bool updated = system.with_row(m.sensor, reading.at, node.belief,
                                         [&](const auto& row, auto& value) SUREFIX_LAMBDA {
                                           return update(value, row, r, innovation, out);
                                         });
    if (!updated) return false;
    node.squares += used * (innovation.square() / out.variance);
    node.product *= out.variance * scale;
    if (!within(node.product, 1e-100, 1e100)) settle(node);
    return true;
  }

  /// The hypotheses of one pack, from the h-th on; one that overflowed has no weight.
  SUREFIX_INLINE void store(const Node& node, Components& to, std::size_t h) const noexcept {
    const int n = node.belief.size();
    Lane sum = node.squares;
    loop<System::size>(
        n, [&](int j) SUREFIX_LAMBDA { sum += node.belief.x(j) + node.belief.P(j, j); });
    const Lane valid = sum * 0.0, log_weight = node.log_weight - 0.5 * node.squares;
    const auto last = static_cast<Eigen::Index>(std::min<std::size_t>(lanes, count_ - h));
    for (Eigen::Index l = 0; l < last; ++l) {
      const std::size_t c = h + static_cast<std::size_t>(l);
      double* x = to.x(c);
      double* P = to.P(c);
      loop<System::size>(n, [&](int j) SUREFIX_LAMBDA {
        x[j] = node.belief.x(j)(l);
        loop<System::size>(n, [&](int i) SUREFIX_LAMBDA { P[j * n + i] = node.belief.P(i, j)(l); });
      });
      to.log_weight(c) = valid(l) == 0.0 ? log_weight(l) - 0.5 * std::log(node.product(l))
                                         : -std::numeric_limits<double>::infinity();
      to.hypothesis(c) = 0;
      to.squares(c) = node.squares(l);
    }
  }

  static void settle(Node& node) noexcept {
    for (Eigen::Index l = 0; l < lanes; ++l) node.log_weight(l) -= 0.5 * std::log(node.product(l));
    node.product = Lane(1.0);
  }

  /// The hypotheses again, behind themselves, with the measurement for an outlier.
  void add_children(double log_outlier) noexcept {
    for (std::size_t h = 0; h < count_; ++h) {
      copy(h, count_ + h);
      lane(nodes_[(count_ + h) / lanes].log_weight, count_ + h) += log_outlier;
    }
  }

  /// Leaves the `most` heaviest hypotheses, in their order.
  void cut(std::size_t most, double& lost) noexcept {
    if (count_ <= most) return;
    double largest = -std::numeric_limits<double>::infinity(), all = 0.0, kept = 0.0;
    for (std::size_t k = 0; k < padded() / lanes; ++k) settle(nodes_[k]);
    for (std::size_t h = 0; h < count_; ++h) {
      const Node& node = nodes_[h / lanes];
      weight_[h] = lane(node.log_weight, h) - 0.5 * lane(node.squares, h);
      if (!(weight_[h] >= -largest_value)) weight_[h] = -largest_value;  // NaN: overflowed
      largest = std::max(largest, weight_[h]);
      order_[h] = h;
    }
    const auto begin = order_.begin(), end = begin + static_cast<std::ptrdiff_t>(most);
    std::nth_element(begin, end, begin + static_cast<std::ptrdiff_t>(count_),
                     [&](std::size_t a, std::size_t b) {
                       return weight_[a] != weight_[b] ? weight_[a] > weight_[b] : a < b;
                     });
    std::sort(begin, end);
    for (std::size_t h = 0; h < count_; ++h) all += std::exp(weight_[h] - largest);
    for (std::size_t h = 0; h < most; ++h) {
      kept += std::exp(weight_[order_[h]] - largest);
      copy(order_[h], h);
      faults_[h] = faults_[order_[h]];
    }
    lost += std::max(1.0 - kept / all, 0.0);
    count_ = most;
  }

  void copy(std::size_t from, std::size_t to) noexcept {
    const Node& a = nodes_[from / lanes];
    Node& b = nodes_[to / lanes];
    const int n = a.belief.size();
    for (int j = 0; j < n; ++j) {
      lane(b.belief.x(j), to) = lane(a.belief.x(j), from);
      for (int i = 0; i < n; ++i) lane(b.belief.P(i, j), to) = lane(a.belief.P(i, j), from);
    }
    lane(b.log_weight, to) = lane(a.log_weight, from);
    lane(b.squares, to) = lane(a.squares, from);
    lane(b.product, to) = lane(a.product, from);
  }
  static double& lane(Lane& value, std::size_t h) noexcept {
    return value(static_cast<Eigen::Index>(h % lanes));
  }
  static double lane(const Lane& value, std::size_t h) noexcept {
    return value(static_cast<Eigen::Index>(h % lanes));
  }

  static constexpr double two_pi = 6.28318530717958647693;

  std::vector<Node> nodes_;
  std::vector<std::uint64_t> faults_;  // bit i: measurement i is an outlier
  std::vector<double> weight_;
  std::vector<std::size_t> order_;
  std::size_t count_ = 0;
};

}  // namespace surefix::robust
