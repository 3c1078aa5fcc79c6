#include "surefix/core/rate_chain.hpp"

#include <gtest/gtest.h>

namespace surefix {
namespace {

RateChain two_modes(double fail, double repair) {
  RateChain chain;
  EXPECT_EQ(chain.make(2, {0.0, fail, repair, 0.0}), ConfigStatus::ok);
  return chain;
}

/// P(healthy → faulty) = λ/(λ+μ) (1 − e^{−(λ+μ)Δt}).
double to_faulty(double fail, double repair, double dt) {
  return -fail / (fail + repair) * std::expm1(-(fail + repair) * dt);
}

TEST(RateChain, OfTwoModesHasItsClosedForm) {
  for (const double fail : {1e-12, 1e-4, 0.3})
    for (const double dt : {1e-9, 1e-3, 0.8, 50.0, 1e5}) {
      RateChain chain = two_modes(fail, 0.5);
      chain.advance(dt);
      const double expected = to_faulty(fail, 0.5, dt);
      EXPECT_NEAR(chain(0, 1), expected, 1e-13 * expected) << fail << " " << dt;
      EXPECT_NEAR(chain(0, 0), 1.0 - expected, 1e-15);
      const double back = to_faulty(0.5, fail, dt);
      EXPECT_NEAR(chain(1, 0), back, 1e-13 * back);
    }
}

TEST(RateChain, StaysWhereItIsInNoTimeAndWithoutRates) {
  RateChain chain = two_modes(0.1, 0.2);
  chain.advance(1.0);
  chain.advance(0.0);
  EXPECT_EQ(chain(0, 0), 1.0);
  EXPECT_EQ(chain(0, 1), 0.0);
  RateChain still = two_modes(0.0, 0.0);
  still.advance(1e12);
  EXPECT_EQ(still(1, 1), 1.0);
}

TEST(RateChain, TwoStepsAreOne) {
  const std::vector<double> rates{0.0, 0.01, 0.002, 1.0, 0.0, 0.0, 0.2, 0.3, 0.0};
  RateChain first, both;
  ASSERT_EQ(first.make(3, rates), ConfigStatus::ok);
  ASSERT_EQ(both.make(3, rates), ConfigStatus::ok);
  first.advance(0.7);
  both.advance(1.4);
  for (int a = 0; a < 3; ++a) {
    double total = 0.0;
    for (int b = 0; b < 3; ++b) {
      double sum = 0.0;
      for (int c = 0; c < 3; ++c) sum += first(a, c) * first(c, b);
      EXPECT_NEAR(both(a, b), sum, 1e-15);
      total += both(a, b);
    }
    EXPECT_NEAR(total, 1.0, 1e-15);
  }
}

TEST(RateChain, ForgetsWhereItStarted) {
  RateChain chain = two_modes(1e-3, 0.2);
  chain.advance(1e12);
  EXPECT_NEAR(chain(0, 1), 1e-3 / 0.201, 1e-15);
  EXPECT_NEAR(chain(1, 1), 1e-3 / 0.201, 1e-15);
}

TEST(RateChain, RefusesRatesThatAreNone) {
  RateChain chain;
  EXPECT_EQ(chain.make(2, {0.0, -1.0, 1.0, 0.0}), ConfigStatus::negative);
  EXPECT_EQ(chain.make(2, {0.0, std::nan(""), 1.0, 0.0}), ConfigStatus::not_finite);
}

}  // namespace
}  // namespace surefix
