// z = γ H x + v, cov(v) = δ R, as rows of independent noise: R = L D Lᵀ, so that L⁻¹z has the rows
// L⁻¹H and the variances D. A mode's γ multiplies the rows, its δ the variances.
#pragma once

#include <array>
#include <cmath>

#include "surefix/core/lane.hpp"
#include "surefix/core/linear_sizes.hpp"
#include "surefix/core/status.hpp"

namespace surefix {

/// Whether a component is infinite, which a missing one (NaN) is not.
template <class Z>
[[nodiscard]] bool is_infinite(const Z& z) noexcept {
  for (int i = 0; i < static_cast<int>(z.size()); ++i)
    if (std::isinf(z(i))) return true;
  return false;
}

/// H (m × n) and R (m × m, positive definite) of one step.
template <class S>
class Observation {
 public:
  // Eigen wants a matrix of one row to be stored by rows.
  static constexpr int order =
      S::stored_m == 1 && S::stored_n != 1 ? Eigen::RowMajor : Eigen::ColMajor;
  using Rows = Eigen::Matrix<double, S::m, S::n, order, S::stored_m, S::stored_n>;
  using Noise = Eigen::Matrix<double, S::m, S::m, 0, S::stored_m, S::stored_m>;
  using Row = typename BeliefOf<S>::Vector;

  [[nodiscard]] ConfigStatus make(const Rows& H, const Noise& R) noexcept {
    if (R.rows() != H.rows() || R.cols() != H.rows()) return ConfigStatus::wrong_size;
    if (!H.allFinite() || !R.allFinite()) return ConfigStatus::not_finite;
    if ((R.array() != R.transpose().array()).any()) return ConfigStatus::not_semidefinite;
    H_ = H;
    R_ = R;
    return factorise() ? ConfigStatus::ok : ConfigStatus::not_positive;
  }

  [[nodiscard]] int size() const noexcept { return static_cast<int>(H_.rows()); }
  [[nodiscard]] double variance(int i) const noexcept { return variance_(i); }
  /// 1 / variance.
  [[nodiscard]] double precision(int i) const noexcept { return precision_(i); }
  /// Π variance^{-1/2}: the density of the noise where it is zero, but for (2π)^{-m/2}.
  [[nodiscard]] double density() const noexcept { return density_; }

  /// Row i for a mode with this γ.
  [[nodiscard]] SUREFIX_INLINE Row row(int i, double gamma) const noexcept {
    const int n = static_cast<int>(rows_.cols());
    Row h;
    if constexpr (S::n == Eigen::Dynamic) h.resize(n);
    h(0) = gamma * rows_(i, 0);  // there is one, which GCC does not know
    loop<S::n>(n, [&](int j) SUREFIX_LAMBDA {
      if (j > 0) h(j) = gamma * rows_(i, j);
    });
    return h;
  }

  /// z ← L⁻¹ z.
  template <class Z>
  SUREFIX_INLINE void whiten(Z& z) const noexcept {
    for (int i = 1; i < size(); ++i)
      for (int j = 0; j < i; ++j) z(i) -= L_(i, j) * z(j);
  }

  /// g ← L⁻ᵀ g: what is a gradient with respect to L⁻¹z becomes one with respect to z.
  template <class Z>
  SUREFIX_INLINE void whiten_transposed(Z& g) const noexcept {
    for (int j = size() - 1; j > 0; --j)
      for (int i = 0; i < j; ++i) g(i) -= L_(j, i) * g(j);
  }
  /// Whether the noise of the components is correlated: L is not the identity.
  [[nodiscard]] bool correlated() const noexcept {
    for (int i = 1; i < size(); ++i)
      for (int j = 0; j < i; ++j)
        if (L_(i, j) != 0.0) return true;
    return false;
  }

  /// Becomes the observation of those components of z that are not NaN, of which `present` are the
  /// values. False if a part of R is not definite, which rounding alone could make of a whole
  /// that is.
  template <class All>
  [[nodiscard]] bool reduce(const Observation<All>& all, const MeasuredOf<All>& z,
                            MeasuredOf<S>& present) noexcept {
    std::array<int, S::max_m> kept{};
    int count = 0;
    for (int i = 0; i < all.size(); ++i)
      if (!std::isnan(z(i))) kept[static_cast<std::size_t>(count++)] = i;
    H_.resize(count, all.H_.cols());
    R_.resize(count, count);
    present.resize(count);
    for (int i = 0; i < count; ++i) {
      present(i) = z(kept[static_cast<std::size_t>(i)]);
      H_.row(i) = all.H_.row(kept[static_cast<std::size_t>(i)]);
      for (int j = 0; j < count; ++j)
        R_(i, j) = all.R_(kept[static_cast<std::size_t>(i)], kept[static_cast<std::size_t>(j)]);
    }
    return factorise();
  }

 private:
  template <class Other>
  friend class Observation;

  [[nodiscard]] bool factorise() noexcept {
    const int m = size();
    L_ = Noise::Identity(m, m);
    variance_.resize(m);
    precision_.resize(m);
    rows_ = H_;
    density_ = 1.0;
    Noise C = R_;
    for (int k = 0; k < m; ++k) {
      const double d = C(k, k);
      if (!(d > 1e-14 * R_(k, k)) || !positive(d)) return false;
      variance_(k) = d;
      precision_(k) = 1.0 / d;
      density_ /= std::sqrt(d);
      for (int i = k + 1; i < m; ++i) L_(i, k) = C(i, k) / d;
      for (int j = k + 1; j < m; ++j)
        for (int i = j; i < m; ++i) C(i, j) -= L_(i, k) * L_(j, k) * d;
    }
    for (int i = 1; i < m; ++i)
      for (int j = 0; j < i; ++j) rows_.row(i) -= L_(i, j) * rows_.row(j);
    return true;
  }

  Rows H_, rows_;
  Noise R_, L_;
  MeasuredOf<S> variance_, precision_;
  double density_ = 0.0;
};

}  // namespace surefix
