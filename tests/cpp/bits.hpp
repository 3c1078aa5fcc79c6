// Equality to the last bit: what "the same numbers" means in this engine.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <cstring>

namespace surefix::test {

inline std::uint64_t bits(double value) {
  std::uint64_t out;
  std::memcpy(&out, &value, sizeof out);
  return out;
}

inline ::testing::AssertionResult same_bits(double a, double b) {
  if (bits(a) == bits(b)) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << a << " and " << b << " differ by " << a - b;
}

template <class A, class B>
::testing::AssertionResult same_bits(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols())
    return ::testing::AssertionFailure() << "sizes differ";
  for (Eigen::Index j = 0; j < a.cols(); ++j)
    for (Eigen::Index i = 0; i < a.rows(); ++i)
      if (bits(a(i, j)) != bits(b(i, j)))
        return ::testing::AssertionFailure() << "(" << i << ", " << j << "): " << a(i, j) << " and "
                                             << b(i, j) << " differ by " << a(i, j) - b(i, j);
  return ::testing::AssertionSuccess();
}

/// Mean and covariance of two beliefs.
template <class A, class B>
::testing::AssertionResult same_belief(const A& a, const B& b) {
  const auto x = same_bits(a.x, b.x);
  return x ? same_bits(a.P, b.P) : x;
}

template <class Derived>
::testing::AssertionResult exactly_symmetric(const Eigen::MatrixBase<Derived>& P) {
  return same_bits(P, P.transpose());
}

}  // namespace surefix::test
