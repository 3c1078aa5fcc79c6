// How a step's mixture is made smaller before the next step, and the mass that it costs.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "surefix/robust/mixture.hpp"

namespace surefix::robust {

/// Keeps the heaviest components of a normalised mixture: as few as leave out no more than `cut`
/// of the mass, at most as many as `to` has room for; `order` is scratch for as many indices as
/// `from` has room for. The weights of `to` are scaled to one again; returns the mass left out.
[[nodiscard]] inline double keep_heaviest(const Components& from, double cut,
                                          std::vector<int>& order, Components& to) noexcept {
  const auto first = order.begin(), last = first + static_cast<std::ptrdiff_t>(from.count());
  for (std::size_t c = 0; c < from.count(); ++c) order[c] = static_cast<int>(c);
  const auto heavier = [&](int a, int b) {
    const double wa = from.log_weight(static_cast<std::size_t>(a));
    const double wb = from.log_weight(static_cast<std::size_t>(b));
    return wa != wb ? wa > wb : a < b;
  };
  std::sort(first, last, heavier);
  std::size_t count = from.count();
  double lost = 0.0;
  for (; count > 1; --count) {
    const auto lightest = static_cast<std::size_t>(order[count - 1]);
    const double more = lost + std::exp(from.log_weight(lightest));
    if (count <= to.capacity() && !(more <= cut)) break;
    lost = more;
  }
  to.resize(count);
  for (std::size_t c = 0; c < count; ++c) to.copy(c, from, static_cast<std::size_t>(order[c]));
  (void)normalise(to);
  return lost;
}

/// One Gaussian with the mixture's mean and covariance: the paper's way. Hypothesis 0, and no
/// bias: the first `n` states alone are carried.
inline void keep_moments(const Components& from, int n, double* x, double* P,
                         Components& to) noexcept {
  const int m = to.state_size();
  moments(from, n, x, P);
  to.resize(1);
  to.log_weight(0) = 0.0;
  to.hypothesis(0) = 0;
  std::fill(to.x(0), to.x(0) + m, 0.0);
  std::fill(to.P(0), to.P(0) + m * m, 0.0);
  for (int j = 0; j < n; ++j) {
    to.x(0)[j] = x[j];
    for (int i = 0; i < n; ++i) to.P(0)[j * m + i] = P[j * n + i];
  }
}

}  // namespace surefix::robust
