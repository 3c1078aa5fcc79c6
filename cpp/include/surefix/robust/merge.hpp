// Components in the same modes are merged, so that a mixture becomes small without losing mass.
//
// In every mode the members that lie farthest apart become centres, the others join the nearest,
// and each cluster becomes one Gaussian with its mass, mean and covariance. Distance is what a
// member j loses when it is taken for centre i, the Kullback-Leibler divergence
//   D(j‖i) = ½ (tr P_i⁻¹P_j − n + (x_j − x_i)ᵀ P_i⁻¹ (x_j − x_i) + log |P_i|/|P_j|).
// Runnalls (2007) weighs it by the masses: a component of mass 1e-9 would then be free to merge
// with anything, and with it the tail that a risk of 1e-11 depends on. Here mass only settles
// between members about equally far.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "surefix/robust/divergence.hpp"
#include "surefix/robust/mixture.hpp"

namespace surefix::robust {

class Merger {
 public:
  Merger() = default;
  /// For mixtures of up to `capacity` components of n states; `active(h, i)`: whether state i has
  /// a variance in hypothesis h.
  template <class Active>
  Merger(int n, int hypotheses, std::size_t capacity, Active&& active)
      : n_(n),
        divergence_(n),
        order_(capacity),
        centre_(capacity),
        distance_(capacity),
        log_determinant_(capacity),
        active_(static_cast<std::size_t>(hypotheses)) {
    for (int h = 0; h < hypotheses; ++h)
      for (int i = 0; i < n; ++i)
        if (active(h, i)) active_[static_cast<std::size_t>(h)].push_back(i);
  }

  /// Merges `from` into at most `per_mode` components a mode; `to` has room for them.
  void merge(const Components& from, int per_mode, Components& to) noexcept {
    const auto first = order_.begin(), last = first + static_cast<std::ptrdiff_t>(from.count());
    for (std::size_t c = 0; c < from.count(); ++c) order_[c] = c;
    std::sort(first, last, [&](std::size_t a, std::size_t b) {
      if (from.hypothesis(a) != from.hypothesis(b)) return from.hypothesis(a) < from.hypothesis(b);
      if (from.log_weight(a) != from.log_weight(b)) return from.log_weight(a) > from.log_weight(b);
      return a < b;
    });
    to.resize(0);
    for (std::size_t begin = 0, end = 0; begin < from.count(); begin = end) {
      while (end < from.count() && from.hypothesis(order_[end]) == from.hypothesis(order_[begin]))
        ++end;
      const int centres = per_mode > 1 ? choose_centres(from, begin, end, per_mode) : 1;
      for (int centre = 0; centre < centres; ++centre)
        pool(from, begin, end, per_mode > 1 ? centre : any_centre, to);
    }
  }

 private:
  static constexpr int any_centre = -1;
  static constexpr double alike = 0.01;         // nats: members closer than this are one
  static constexpr double mass_exponent = 0.1;  // how much mass counts against distance

  /// Assigns the members order_[begin … end), heaviest first, to at most `most` centres.
  int choose_centres(const Components& from, std::size_t begin, std::size_t end,
                     int most) noexcept {
    const std::vector<int>& active = active_[idx(from.hypothesis(order_[begin]))];
    for (std::size_t i = begin; i < end; ++i) {
      distance_[i] = std::numeric_limits<double>::infinity();
      log_determinant_[i] = divergence_.factorise(from.P(order_[i]), active);
    }
    std::size_t next = begin;
    for (int centre = 0;; ++centre) {
      const std::size_t c = next;
      (void)divergence_.factorise(from.P(order_[c]), active);
      double best = -std::numeric_limits<double>::infinity();
      for (std::size_t i = begin; i < end; ++i) {
        const double log_ratio = log_determinant_[c] - log_determinant_[i];
        const double distance = i == c ? 0.0
                                       : divergence_(from.x(order_[i]), from.P(order_[i]),
                                                     from.x(order_[c]), active, log_ratio);
        if (!(distance >= distance_[i])) {
          distance_[i] = distance;
          centre_[i] = centre;
        }
        const double score = std::log(distance_[i]) + mass_exponent * from.log_weight(order_[i]);
        if (distance_[i] < alike || score <= best) continue;
        best = score;
        next = i;
      }
      if (next == c || centre + 1 == most) return centre + 1;
    }
  }

  /// One Gaussian with the mass, mean and covariance of a centre's members.
  void pool(const Components& from, std::size_t begin, std::size_t end, int centre,
            Components& to) noexcept {
    const std::size_t c = to.count();
    double* x = to.x(c);
    double* P = to.P(c);
    std::fill(x, x + n_, 0.0);
    std::fill(P, P + n_ * n_, 0.0);
    const double largest = from.log_weight(order_[begin]);
    if (!(largest > -std::numeric_limits<double>::infinity())) return;
    const auto each = [&](auto&& visit) {
      for (std::size_t i = begin; i < end; ++i) {
        const double w = std::exp(from.log_weight(order_[i]) - largest);
        if (w > 0.0 && (centre == any_centre || centre_[i] == centre)) visit(order_[i], w);
      }
    };
    double total = 0.0;
    each([&](std::size_t m, double w) {
      total += w;
      for (int a = 0; a < n_; ++a) x[a] += w * from.x(m)[a];
    });
    if (!(total > 0.0)) return;
    for (int a = 0; a < n_; ++a) x[a] /= total;
    each([&](std::size_t m, double w) {
      for (int b = 0; b < n_; ++b)
        for (int a = 0; a < n_; ++a)
          P[b * n_ + a] +=
              w / total * (from.P(m)[b * n_ + a] + (from.x(m)[a] - x[a]) * (from.x(m)[b] - x[b]));
    });
    to.log_weight(c) = largest + std::log(total);
    to.hypothesis(c) = from.hypothesis(order_[begin]);
    to.squares(c) = 0.0;
    to.resize(c + 1);
  }

  static std::size_t idx(int i) noexcept { return static_cast<std::size_t>(i); }

  int n_ = 0;
  Divergence divergence_;
  std::vector<std::size_t> order_;
  std::vector<int> centre_;
  std::vector<double> distance_, log_determinant_;
  std::vector<std::vector<int>> active_;  // of every hypothesis
};

}  // namespace surefix::robust
