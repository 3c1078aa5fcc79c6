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
  /// `square`: ν² / S.
  SUREFIX_INLINE void add(double variance, double square) noexcept {
    product_ *= normalised(variance);
    if (!(product_ > 1e-140 && product_ < 1e140)) product_ = set_aside(product_);
    squares_ += square;
    ++count_;
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
  [[nodiscard]] SUREFIX_INLINE double set_aside(double value) noexcept {
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    exponent_ += exponent;
    return mantissa;
  }
  [[nodiscard]] SUREFIX_INLINE double normalised(double variance) noexcept {
    return variance > 1e-140 && variance < 1e140 ? variance : set_aside(variance);
  }

  double product_ = 1.0;
  std::int64_t exponent_ = 0;
  double squares_ = 0.0;
  std::int64_t count_ = 0;
};

}  // namespace surefix
