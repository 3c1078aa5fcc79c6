#include "surefix/core/log_likelihood.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "random.hpp"

namespace surefix {
namespace {

using namespace test;

/// −½ (log 2π + log S + ν²/S), the textbook's way.
long double log_density(double variance, double square) {
  return -0.5L * (1.837877066409345483560659L + std::log(static_cast<long double>(variance)) +
                  static_cast<long double>(square));
}

/// 100,000 innovations with variances drawn by `variance`.
template <class Draw>
void expect_sum(Draw&& variance) {
  Random random(13);
  LogLikelihood accumulator;
  long double expected = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    const double S = variance(random), square = random.uniform(0.0, 10.0);
    accumulator.add_variance(S);
    accumulator.add_squares(square, 1);
    expected += log_density(S, square);
  }
  const double value = static_cast<double>(expected);
  EXPECT_NEAR(accumulator.value(), value, 1e-12 * std::abs(value) + 1e-9);
  EXPECT_EQ(accumulator.count(), 100'000);
}

TEST(LogLikelihood, IsTheSumOfTheLogs) {
  expect_sum([](Random& random) { return random.log_uniform(0.1, 10.0); });
}

TEST(LogLikelihood, IsTheSumOfTheLogsOfExtremeVariances) {
  expect_sum([](Random& random) { return random.log_uniform(1e-300, 1e300); });
}

TEST(LogLikelihood, NeitherUnderflowsNorOverflows) {
  expect_sum([](Random&) { return 1e-300; });
  expect_sum([](Random&) { return 1e300; });
  expect_sum([](Random&) { return 1e139; });
  expect_sum([](Random&) { return 1e-139; });
  expect_sum([](Random&) { return 5e-324; });
  expect_sum([](Random&) { return std::numeric_limits<double>::max(); });
}

TEST(LogLikelihood, OfNothingIsZero) { EXPECT_EQ(LogLikelihood().value(), 0.0); }

TEST(LogLikelihood, ContinuesFromWhatWasSavedWithTheSameBits) {
  Random random(14);
  LogLikelihood one;
  for (int i = 0; i < 1000; ++i) one.add_variance(random.log_uniform(1e-100, 1e100));
  one.add_squares(random.uniform(), 1000);
  LogLikelihood other;
  other.restore(one.save());
  for (int i = 0; i < 1000; ++i) {
    const double S = random.log_uniform(1e-100, 1e100), square = random.uniform();
    for (auto* l : {&one, &other}) {
      l->add_variance(S);
      l->add_squares(square, 1);
    }
    ASSERT_TRUE(same_bits(one.value(), other.value()));
  }
  EXPECT_EQ(one.count(), other.count());
}

}  // namespace
}  // namespace surefix
