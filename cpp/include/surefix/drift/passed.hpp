// One scalar measurement as a filter passed it, as a row of numbers: what the sweeps and responses
// of this folder read.
#pragma once

#include <cstdint>

#include "surefix/core/row.hpp"
#include "surefix/core/transition.hpp"
#include "surefix/core/update.hpp"

namespace surefix::drift {

/// One scalar measurement as the filter passed it.
template <int N, int MaxN>
struct Passed {
  using Vector = Eigen::Map<const typename Gaussian<N, double, MaxN>::Vector>;
  using Matrix = Eigen::Map<const typename Gaussian<N, double, MaxN>::Matrix>;

  double inverse;  ///< 1/S
  double noise;    ///< variance r of the measurement alone
  double elapsed;  ///< time since the measurement before it; 0: at the same time, no transition
  Vector gain;     ///< k (n)
  Vector row;      ///< h (n)
  MatrixTransition<N, MaxN, Matrix> transition;  ///< F (n × n) from the measurement before it
  std::int32_t channel;

  [[nodiscard]] DenseRow<Vector> h() const noexcept { return {row}; }

  /// How many numbers it is for n states.
  [[nodiscard]] static constexpr int numbers(int n) noexcept { return 3 + 2 * n + n * n; }
  /// A view of them.
  [[nodiscard]] SUREFIX_INLINE static Passed view(const double* at, int n,
                                                  std::int32_t channel) noexcept {
    const double *k = at + 3, *h = k + n, *F = h + n;
    return {at[0], at[1], at[2], Vector(k, n), Vector(h, n), {Matrix(F, n, n)}, channel};
  }
  /// Writes them: 1/S and the gain of `innovation`, the row h, the noise's variance, and F (n × n)
  /// with the time `elapsed` > 0 since the measurement before; elapsed = 0: of the same time.
  template <class Row, class F>
  static void write(double* to, const Innovation<Gaussian<N, double, MaxN>>& innovation,
                    const Row& h, double noise, const F& transition, double elapsed) noexcept {
    const int n = static_cast<int>(innovation.gain.size());
    *to++ = innovation.inverse;
    *to++ = noise;
    *to++ = elapsed;
    for (int i = 0; i < n; ++i) *to++ = innovation.gain(i);
    for (int i = 0; i < n; ++i) to[i] = 0.0;
    h.for_each([&](int i, double hi) { to[i] = hi; });
    to += n;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) *to++ = elapsed > 0.0 ? transition(i, j) : 0.0;
  }
};

}  // namespace surefix::drift
