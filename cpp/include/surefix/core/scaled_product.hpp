// A product of many positive numbers, lane by lane, whose logarithm is taken once at the end: when
// it leaves the middle of the exponent range its exponent is set aside.
#pragma once

#include <cmath>

#include "surefix/core/lane.hpp"

namespace surefix {

/// Π v in every lane. What one lane goes through does not depend on the others.
template <class Lane>
class ScaledProduct {
 public:
  SUREFIX_INLINE void multiply(const Lane& v) noexcept {
    const Lane product = product_ * v;
    if (within(product, lowest, highest)) {
      product_ = product;
    } else {
      multiply_each(v);
    }
  }
  /// log Π v of one lane.
  [[nodiscard]] double log(int lane) const noexcept {
    constexpr double log_2 = 0.69314718055994530942;
    return std::log(Lanes<Lane>::get(product_, lane)) + Lanes<Lane>::get(exponent_, lane) * log_2;
  }
  /// One lane of `from` becomes lane `to` of this.
  template <class Other>
  void copy_lane(int to, const ScaledProduct<Other>& from, int lane) noexcept {
    Lanes<Lane>::set(product_, to, Lanes<Other>::get(from.product_, lane));
    Lanes<Lane>::set(exponent_, to, Lanes<Other>::get(from.exponent_, lane));
  }

 private:
  template <class Other>
  friend class ScaledProduct;

  static constexpr double lowest = 1e-140, highest = 1e140;

  void multiply_each(const Lane& v) noexcept {
    using L = Lanes<Lane>;
    for (int i = 0; i < L::count; ++i) {
      const double factor = L::get(v, i);
      double product = L::get(product_, i) * factor;
      if (!within(product, lowest, highest)) {  // of the mantissas, which cannot overflow
        int first = 0, second = 0;
        product = std::frexp(L::get(product_, i), &first) * std::frexp(factor, &second);
        L::set(exponent_, i, L::get(exponent_, i) + first + second);
      }
      L::set(product_, i, product);
    }
  }

  Lane product_ = Lanes<Lane>::all(1.0);
  Lane exponent_ = Lanes<Lane>::all(0.0);
};

}  // namespace surefix
