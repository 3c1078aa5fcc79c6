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
    product_ *= v;
    if (!within(product_, 1e-140, 1e140)) set_aside();
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

  void set_aside() noexcept {
    for (int i = 0; i < Lanes<Lane>::count; ++i) {
      const double product = Lanes<Lane>::get(product_, i);
      if (within(product, 1e-140, 1e140)) continue;
      int exponent = 0;
      Lanes<Lane>::set(product_, i, std::frexp(product, &exponent));
      Lanes<Lane>::set(exponent_, i, Lanes<Lane>::get(exponent_, i) + exponent);
    }
  }

  Lane product_ = Lanes<Lane>::all(1.0);
  Lane exponent_ = Lanes<Lane>::all(0.0);
};

}  // namespace surefix
