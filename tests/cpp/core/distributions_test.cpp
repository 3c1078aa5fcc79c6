// Expected values: mpmath 1.3 with 40 digits.
#include "surefix/core/distributions.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace surefix {
namespace {

TEST(Distributions, TwoSidedNormalQuantileDownToTheSmallestRisks) {
  EXPECT_NEAR(normal_two_sided(0.5), 0.67448975019608174, 1e-15);
  EXPECT_NEAR(normal_two_sided(1e-3), 3.2905267314918948, 1e-14);
  EXPECT_NEAR(normal_two_sided(1e-7), 5.3267238863844963, 1e-14);
  EXPECT_NEAR(normal_two_sided(1e-9), 6.1094102048693971, 1e-14);
  EXPECT_NEAR(normal_two_sided(1e-11), 6.8065024907406263, 1e-14);
  EXPECT_NEAR(normal_two_sided(1e-15), 8.0268588825345409, 1e-14);
}

void expect_tail(double x, double degrees, double expected) {
  EXPECT_NEAR(chi_squared_tail(x, degrees) / expected, 1.0, 1e-12) << x << ", " << degrees;
}

TEST(Distributions, ChiSquaredTailKeepsItsRelativePrecision) {
  expect_tail(0.0, 5, 1.0);
  expect_tail(1.0, 1, 0.3173105078629141);
  expect_tail(3.84, 1, 0.050043521248705103);
  expect_tail(7.0, 3, 0.071897772496465127);
  expect_tail(40.0, 20, 0.0049954123083075872);
  expect_tail(1200.0, 1000, 1.2255942330622904e-5);
  expect_tail(100.0, 3, 1.5541594313896049e-21);
  expect_tail(600.0, 20, 2.8784992655370182e-114);
}

void expect_threshold(double probability, double degrees, double expected) {
  EXPECT_NEAR(chi_squared_threshold(probability, degrees) / expected, 1.0, 1e-12)
      << probability << ", " << degrees;
}

TEST(Distributions, ChiSquaredThresholds) {
  expect_threshold(0.5, 2, 1.3862943611198906);
  expect_threshold(1e-5, 7, 35.258536421480874);
  expect_threshold(1e-11, 1, 46.328476156458349);
  expect_threshold(1e-11, 10, 73.340472181350615);
  expect_threshold(1e-15, 100, 256.63497366715241);
  expect_threshold(1e-3, 1000, 1143.9170926196792);
}

TEST(Distributions, OneDegreeOfFreedomIsTheNormalSquared) {
  for (double risk : {0.3, 1e-5, 1e-11, 1e-15}) {
    const double K = normal_two_sided(risk);
    EXPECT_NEAR(chi_squared_threshold(risk, 1) / (K * K), 1.0, 1e-12);
  }
}

TEST(Distributions, OutsideTheirDomainAreNotANumber) {
  EXPECT_TRUE(std::isnan(normal_two_sided(-0.1)));
  EXPECT_TRUE(std::isnan(normal_two_sided(std::nan(""))));
  EXPECT_TRUE(std::isnan(chi_squared_tail(-1.0, 3)));
  EXPECT_TRUE(std::isnan(chi_squared_tail(1.0, -3)));
  EXPECT_TRUE(std::isnan(chi_squared_threshold(1.5, 3)));
  for (const double noncentrality : {2.0, 2e6}) {  // Boost's series, and far out
    EXPECT_TRUE(std::isnan(noncentral_chi_squared_tail(-1.0, 3, noncentrality)));
    EXPECT_TRUE(std::isnan(noncentral_chi_squared_cdf(-1.0, 3, noncentrality)));
    EXPECT_TRUE(std::isnan(noncentral_chi_squared_tail(1.0, -3, noncentrality)));
    EXPECT_TRUE(std::isnan(noncentral_chi_squared_tail(0.0, -3, noncentrality)));
  }
  EXPECT_TRUE(std::isnan(noncentral_chi_squared_tail(0.0, 3, -2.0)));
  EXPECT_TRUE(std::isnan(noncentrality_for(0.0, 1.0, 3)));
  EXPECT_TRUE(std::isnan(noncentrality_for(1.0, 1.0, 3)));
}

TEST(Distributions, NoncentralChiSquaredWhereItsSeriesAreNotSummed) {
  EXPECT_EQ(noncentral_chi_squared_tail(0.0, 3, 2.0), 1.0);
  EXPECT_EQ(noncentral_chi_squared_density(0.0, 5, 3.0), 0.0);
  EXPECT_NEAR(noncentral_chi_squared_density(2e6, 2, 2e6) / 1.4104740470240371e-4, 1.0, 1e-8);
  EXPECT_EQ(noncentral_chi_squared_density(1e5, 2, 2e6), 0.0);
}

}  // namespace
}  // namespace surefix
