// The log-likelihood of a run of scalar innovations without a logarithm for each: the variances
// are multiplied, and only when the product leaves the middle of the exponent range is its
// exponent set aside.
#pragma once

#include <cmath>
#include <cstdint>

#include "surefix/core/loop.hpp"

namespace surefix {

/// Accumulates Σ log S_i and Σ ν_i² / S_i.
class LogLikelihood {
 public:
  /// One innovation's variance S.
  SUREFIX_INLINE void add_variance(double variance) noexcept {
    const double product = product_ * variance;
    const bool middle = product > 1e-140 && product < 1e140;
    product_ = middle ? product : set_aside(product_) * set_aside(variance);
  }
  /// The sum of ν² / S over `count` innovations whose variances were added.
  SUREFIX_INLINE void add_squares(double sum, std::int64_t count) noexcept {
    squares_ += sum;
    count_ += count;
  }

  /// log p(z) = −½ (N log 2π + Σ log S_i + Σ ν_i² / S_i).
  [[nodiscard]] double value() const noexcept {
    constexpr double log_2 = 0.69314718055994530942, log_2pi = 1.83787706640934548356;
    const double log_determinant = std::log(product_) + static_cast<double>(exponent_) * log_2;
    return -0.5 * (static_cast<double>(count_) * log_2pi + log_determinant + squares_);
  }
  [[nodiscard]] std::int64_t count() const noexcept { return count_; }

  struct Saved {
    double product;
    std::int64_t exponent;
    double squares;
    std::int64_t count;
  };
  [[nodiscard]] Saved save() const noexcept { return {product_, exponent_, squares_, count_}; }
  void restore(const Saved& saved) noexcept {
    product_ = saved.product;
    exponent_ = saved.exponent;
    squares_ = saved.squares;
    count_ = saved.count;
  }

 private:
  [[nodiscard]] double set_aside(double value) noexcept {
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    exponent_ += exponent;
    return mantissa;
  }

  double product_ = 1.0;
  std::int64_t exponent_ = 0;
  double squares_ = 0.0;
  std::int64_t count_ = 0;
};

}  // namespace surefix
