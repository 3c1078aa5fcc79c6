// A few steps of a pack of series, between the arrays of the caller and the lanes of the steps.
//
// Numbers that are stored one by one and loaded together the moment after wait for each other; and
// writing every series' array step by step touches each cache line many times. A panel moves eight
// steps at once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "surefix/core/lane.hpp"

namespace surefix::switching {

/// `depth` steps of `entries` numbers of each series.
template <class Lane>
class Panel {
 public:
  static constexpr int depth = 8;
  static constexpr int width = Lanes<Lane>::count;

  explicit Panel(int entries)
      : entries_(entries), data_(static_cast<std::size_t>(depth * entries)) {}

  /// Entry e of the panel's step s.
  [[nodiscard]] SUREFIX_INLINE Lane& operator()(int s, int e) noexcept {
    return data_[static_cast<std::size_t>(s * entries_ + e)];
  }

  /// ← steps k … k + count − 1 of series `run` and those after it of an array (runs, T, entries);
  /// lanes beyond `lanes` have the last series again.
  void read(const double* from, std::int64_t run, int lanes, int T, int k, int count) noexcept {
    for (int l = 0; l < width; ++l) {
      const double* own = from + ((run + std::min(l, lanes - 1)) * T + k) * entries_;
      in_eights(count * entries_, [&](int i) SUREFIX_LAMBDA {
        Lanes<Lane>::set(data_[static_cast<std::size_t>(i)], l, own[i]);
      });
    }
  }

  /// → the same; null: nowhere.
  void write(double* to, std::int64_t run, int lanes, int T, int k, int count) const noexcept {
    if (to == nullptr) return;
    for (int l = 0; l < lanes; ++l) {
      double* own = to + ((run + l) * T + k) * entries_;
      in_eights(count * entries_, [&](int i) SUREFIX_LAMBDA {
        own[i] = Lanes<Lane>::get(data_[static_cast<std::size_t>(i)], l);
      });
    }
  }

  /// The first of `count` steps in which a lane is not finite, and that lane; −1 if all are.
  [[nodiscard]] int first_not_finite(int count, int lanes, int& lane) const noexcept {
    for (int i = 0; i < count * entries_; ++i)
      for (lane = 0; lane < lanes; ++lane)
        if (!finite(Lanes<Lane>::get(data_[static_cast<std::size_t>(i)], lane)))
          return i / entries_;
    return -1;
  }

 private:
  /// f(0) … f(n − 1), eight at a time without a loop.
  template <class F>
  SUREFIX_INLINE static void in_eights(int n, F&& f) noexcept {
    int i = 0;
    for (; i + 8 <= n; i += 8) {
      const auto eight = [&](int e) SUREFIX_LAMBDA { f(i + e); };
      unrolled(eight, std::make_integer_sequence<int, 8>{});
    }
    for (; i < n; ++i) f(i);
  }

  int entries_;
  std::vector<Lane> data_;
};

/// The panels of all that a filter gives: x, P, and the probabilities of M modes.
template <class Lane>
struct Estimates {
  Panel<Lane> x, P, mode;

  Estimates(int n, int M) : x(n), P(n * n), mode(M) {}

  template <class G>
  SUREFIX_INLINE void keep(int s, const G& belief) noexcept {
    constexpr int N = G::fixed_size;
    const int n = belief.size();
    loop<N>(n, [&](int a) SUREFIX_LAMBDA {
      x(s, a) = belief.x(a);
      loop<N>(n, [&](int b) SUREFIX_LAMBDA { P(s, a * n + b) = belief.P(a, b); });
    });
  }

  /// The first of `count` steps that is not finite, and its lane; −1 if there is none, which the
  /// last one shows: what is infinite once never becomes finite again.
  template <class G>
  [[nodiscard]] int first_overflow(const G& last, int count, int lanes, int& lane) const noexcept {
    bool good = true;
    for (int i = 0; i < last.size(); ++i) good &= finite(last.x(i)) && finite(last.P(i, i));
    const int step = good ? -1 : x.first_not_finite(count, lanes, lane);
    return good || step >= 0 ? step : P.first_not_finite(count, lanes, lane);
  }
};

}  // namespace surefix::switching
