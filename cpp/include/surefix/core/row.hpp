// Rows of an observation matrix H, in the forms that the update and the backward sweep need:
//   dot(v)       h v
//   times(P)     P hᵀ
//   for_each(f)  f(index, coefficient) for every entry that is not zero
//   component    the index if the row reads one component as it is, known at compile time; else −1
#pragma once

#include <array>

#include "surefix/core/gaussian.hpp"

namespace surefix {

/// The row that reads component I of the state: multiplications by zero and one cost nothing.
template <int I>
struct ComponentRow {
  static constexpr int component = I;

  template <class Vector>
  [[nodiscard]] SUREFIX_INLINE auto dot(const Vector& v) const noexcept {
    return v(I);
  }
  template <class G>
  [[nodiscard]] SUREFIX_INLINE typename G::Vector times(const G& belief) const noexcept {
    if constexpr (G::fixed_size == 1) return belief.P;
    typename G::Vector b = belief.x;  // the size; every entry is overwritten
    loop<G::fixed_size>(belief.size(), [&](int i) SUREFIX_LAMBDA { b(i) = belief.P(i, I); });
    return b;
  }
  template <class F>
  SUREFIX_INLINE void for_each(F&& f) const noexcept {
    f(I, 1.0);
  }
};

/// A row with at most `Max` entries that are not zero; on a pack the entries differ between lanes
/// where the row was linearised at different states.
template <int Max, class Lane = double>
class SparseRow {
 public:
  static constexpr int component = -1;

  void add(int index, const Lane& coefficient) noexcept {
    index_[static_cast<std::size_t>(count_)] = index;
    coefficient_[static_cast<std::size_t>(count_)] = coefficient;
    ++count_;
  }
  template <class Vector>
  [[nodiscard]] SUREFIX_INLINE auto dot(const Vector& v) const noexcept {
    typename Vector::Scalar sum = v(index(0)) * coefficient(0);
    for (int e = 1; e < count_; ++e) sum += v(index(e)) * coefficient(e);
    return sum;
  }
  template <class G>
  [[nodiscard]] SUREFIX_INLINE typename G::Vector times(const G& belief) const noexcept {
    typename G::Vector b = belief.x;  // the size; every entry is overwritten
    const int n = belief.size();
    for (int i = 0; i < n; ++i) b(i) = belief.P(i, index(0)) * coefficient(0);
    for (int e = 1; e < count_; ++e)
      for (int i = 0; i < n; ++i) b(i) += belief.P(i, index(e)) * coefficient(e);
    return b;
  }
  template <class F>
  SUREFIX_INLINE void for_each(F&& f) const noexcept {
    for (int e = 0; e < count_; ++e) f(index(e), coefficient(e));
  }

 private:
  [[nodiscard]] int index(int e) const noexcept { return index_[static_cast<std::size_t>(e)]; }
  [[nodiscard]] const Lane& coefficient(int e) const noexcept {
    return coefficient_[static_cast<std::size_t>(e)];
  }

  int count_ = 0;
  std::array<int, Max> index_;  // the first `count_`
  std::array<Lane, Max> coefficient_;
};

/// A row given as a dense vector of the state's size.
template <class Vector>
struct DenseRow {
  static constexpr int component = -1;
  const Vector& h;

  template <class V>
  [[nodiscard]] SUREFIX_INLINE auto dot(const V& v) const noexcept {
    typename V::Scalar sum = v(0) * h(0);
    for (int i = 1; i < static_cast<int>(h.size()); ++i) sum += v(i) * h(i);
    return sum;
  }
  template <class G>
  [[nodiscard]] SUREFIX_INLINE typename G::Vector times(const G& belief) const noexcept {
    const int n = belief.size();
    typename G::Vector b;
    if constexpr (G::fixed_size == Eigen::Dynamic) b.resize(n);
    for (int i = 0; i < n; ++i) b(i) = belief.P(i, 0) * h(0);
    for (int j = 1; j < n; ++j)
      for (int i = 0; i < n; ++i) b(i) += belief.P(i, j) * h(j);
    return b;
  }
  template <class F>
  SUREFIX_INLINE void for_each(F&& f) const noexcept {
    for (int i = 0; i < static_cast<int>(h.size()); ++i)
      if (h(i) != 0.0) f(i, h(i));
  }
};

}  // namespace surefix
