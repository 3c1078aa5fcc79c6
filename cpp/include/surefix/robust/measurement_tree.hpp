// The hypotheses per measurement: each measurement of a step is healthy or an outlier on its own,
// 2^N of them. The tree grows level by level in the order of time, so that every new hypothesis
// costs one scalar update, and four of them go side by side.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "surefix/robust/per_measurement.hpp"
#include "surefix/robust/tree_node.hpp"

namespace surefix::robust {

/// What a tree may leave out: hypotheses of a share below `worth` of all, and those with more than
/// `max_outliers`.
struct TreeLimits {
  double worth = 0.0;
  int max_outliers = PerMeasurement::max_measurements;
};

template <class System>
class MeasurementTree {
  using Node = TreeNode<System>;
  static constexpr std::size_t lanes = Node::lanes;

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
    log_lost_ = -std::numeric_limits<double>::infinity();
    count_ = from.count();
    for (std::size_t h = 0; h < padded(); ++h) {
      nodes_[h / lanes].load(lane(h), from, std::min(h, count_ - 1));
      faults_[h] = 0;
    }
  }

  /// Takes a measurement after its leg; `bit` ≤ 63 is set in the hypotheses that hold it for an
  /// outlier. Where there is no room for both children of all, the lightest go. False if a variance
  /// overflows.
  template <class Leg>
  [[nodiscard]] bool grow(const System& system, const Leg& leg, const desync::Measurement& m,
                          int bit, const OutlierPrior& prior) noexcept {
    const double sigma = m.factor * system.sensor(m.sensor).sigma, variance = sigma * sigma;
    const bool outliers = prior.log_outlier > -std::numeric_limits<double>::infinity();
    if (outliers && 2 * padded() > faults_.size()) keep({}, faults_.size() / 2);
    // What went before may have been right about this one, whatever the others say of it.
    constexpr double half_log_2pi = 0.91893853320467274178;
    if (log_lost_ > -std::numeric_limits<double>::infinity())
      log_lost_ += log_sum(prior.log_healthy - half_log_2pi - std::log(sigma), prior.log_outlier);
    const std::size_t parents = count_;
    const bool whole = parents % lanes == 0;  // then children have packs of their own
    if (outliers && !whole) {
      for (std::size_t k = 0; k < padded() / lanes; ++k) nodes_[k].move(leg);
      add_children(prior.log_outlier);
    }
    for (std::size_t k = 0; k < (parents + lanes - 1) / lanes; ++k) {
      Node& node = nodes_[k];
      if (!outliers || whole) node.move(leg);
      if (outliers && whole) {
        Node& child = nodes_[parents / lanes + k];
        child = node;
        child.log_weight += prior.log_outlier;
      }
      if (!node.absorb(system, m, variance, parents - k * lanes, prior.log_healthy)) return false;
    }
    if (!outliers) return true;
    for (std::size_t h = 0; h < parents; ++h)
      faults_[parents + h] = faults_[h] | std::uint64_t{1} << bit;
    count_ = 2 * parents;
    pad();
    return true;
  }

  /// Leaves out what `limits` allow.
  void prune(const TreeLimits& limits) noexcept { keep(limits, count_); }

  /// Log of a bound on the joint density of the measurements so far and of all hypotheses that were
  /// left out on the way: each had, of every measurement since, at most the density at its mean of
  /// a sensor whose state is known, or that of an outlier.
  [[nodiscard]] double log_lost() const noexcept { return log_lost_; }

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] std::uint64_t faults(std::size_t h) const noexcept { return faults_[h]; }
  /// Goes on to the estimate, and gives the leaves as components, log-weights not normalised; `to`
  /// has room for `count`.
  template <class Leg>
  void finish(const Leg& leg, Components& to) noexcept {
    to.resize(count_);
    for (std::size_t h = 0; h < count_; h += lanes) {
      Node& node = nodes_[h / lanes];
      node.settle();
      node.move(leg);
      node.store(to, h, std::min(lanes, count_ - h));
    }
  }

 private:
  [[nodiscard]] std::size_t padded() const noexcept { return (count_ + lanes - 1) / lanes * lanes; }
  static Eigen::Index lane(std::size_t h) noexcept { return static_cast<Eigen::Index>(h % lanes); }
  void copy(std::size_t from, std::size_t to) noexcept {
    nodes_[to / lanes].copy(lane(to), nodes_[from / lanes], lane(from));
  }

  /// The hypotheses again, behind themselves, with the measurement for an outlier.
  void add_children(double log_outlier) noexcept {
    for (std::size_t h = 0; h < count_; ++h) {
      copy(h, count_ + h);
      nodes_[(count_ + h) / lanes].log_weight(lane(count_ + h)) += log_outlier;
    }
  }

  /// Leaves, in their order, the hypotheses that `limits` let stay, of them the `most` heaviest,
  /// and never none.
  void keep(const TreeLimits& limits, std::size_t most) noexcept {
    double largest = 0.0;
    const double all = weigh(largest);
    std::size_t left = 0, heaviest = 0;
    for (std::size_t h = 0; h < count_; ++h) {
      if (weight_[h] > weight_[heaviest]) heaviest = h;
      if (weight_[h] >= limits.worth * all && outliers(faults_[h]) <= limits.max_outliers)
        order_[left++] = h;
    }
    if (left == 0) order_[left++] = heaviest;
    const auto begin = order_.begin();
    if (left > most) {
      const auto end = begin + static_cast<std::ptrdiff_t>(most);
      std::nth_element(begin, end, begin + static_cast<std::ptrdiff_t>(left),
                       [&](std::size_t a, std::size_t b) {
                         return weight_[a] != weight_[b] ? weight_[a] > weight_[b] : a < b;
                       });
      std::sort(begin, end);
      left = most;
    }
    if (left == count_) return;
    double gone = 0.0;  // summed, not 1 − what is kept: it may be below the rounding of one
    std::size_t to = 0;
    for (std::size_t h = 0; h < count_; ++h) {
      if (to == left || order_[to] != h) {
        gone += weight_[h];
        continue;
      }
      if (to != h) copy(h, to);
      faults_[to++] = faults_[h];
    }
    log_lost_ = log_sum(log_lost_, largest + std::log(gone));
    count_ = left;
    pad();
  }

  /// Fills the last pack with copies of the last hypothesis.
  void pad() noexcept {
    for (std::size_t h = count_; h < padded(); ++h) copy(count_ - 1, h);
  }

  /// log (eᵃ + eᵇ)
  static double log_sum(double a, double b) noexcept {
    const double high = std::max(a, b), low = std::min(a, b);
    return high > -std::numeric_limits<double>::infinity() ? high + std::log1p(std::exp(low - high))
                                                           : high;
  }

  /// Weights over the largest, whose logarithm it is; returns their sum. What overflowed has none.
  double weigh(double& largest) noexcept {
    double all = 0.0;
    largest = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < padded() / lanes; ++k) nodes_[k].settle();
    for (std::size_t h = 0; h < count_; ++h) {
      const Node& node = nodes_[h / lanes];
      weight_[h] = node.log_weight(lane(h)) - 0.5 * node.squares(lane(h));
      if (!(weight_[h] >= -largest_value)) weight_[h] = -largest_value;
      largest = std::max(largest, weight_[h]);
    }
    for (std::size_t h = 0; h < count_; ++h) all += weight_[h] = std::exp(weight_[h] - largest);
    return all;
  }

  static int outliers(std::uint64_t faults) noexcept {
    int count = 0;
    for (; faults != 0; faults &= faults - 1) ++count;
    return count;
  }

  std::vector<Node> nodes_;
  std::vector<std::uint64_t> faults_;  // bit i: measurement i is an outlier
  std::vector<double> weight_;
  std::vector<std::size_t> order_;
  std::size_t count_ = 0;
  double log_lost_ = 0.0;
};

}  // namespace surefix::robust
