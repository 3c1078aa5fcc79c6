#include "surefix/desync/composite_step.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "bits.hpp"
#include "composite_reference.hpp"
#include "printing.hpp"

namespace surefix::desync {
namespace {

using namespace test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void expect_equal(const StepUpdate& actual, const StepReference& expected) {
  EXPECT_LT(error(actual.x, expected.x), 1e-12);
  EXPECT_LT(error(actual.P, expected.P), 1e-12);
  EXPECT_TRUE(exactly_symmetric(actual.P));
  ASSERT_EQ(actual.innovation.size(), expected.innovation.size());
  ASSERT_EQ(actual.noise.size(), expected.noise.size());
  if (expected.innovation.size() > 0) {
    EXPECT_LT(error(actual.innovation, expected.innovation), 1e-12);
    EXPECT_LT(error(actual.noise, expected.noise), 1e-11);
    EXPECT_LT(error(actual.noise_variance, expected.noise_variance), 1e-11);
  }
  EXPECT_NEAR(actual.sse, static_cast<double>(expected.sse), 1e-11 * (1.0 + actual.sse));
  EXPECT_NEAR(actual.log_likelihood, static_cast<double>(expected.log_likelihood), 1e-11);
}

void expect_both_ways(const StepCase& c) {
  const StepReference expected = brute_force(c);
  const CompositeStep step(c.legs, c.observations);
  ASSERT_TRUE(step.separable());
  StepUpdate composite, sequential;
  ASSERT_EQ(step.composite(c.x, c.P, c.z, c.u, composite), Status::ok);
  ASSERT_EQ(step.sequential(c.x, c.P, c.z, c.u, sequential), Status::ok);
  expect_equal(composite, expected);
  expect_equal(sequential, expected);
}

TEST(CompositeStep, BothWaysAreTheConditioningOfAJointGaussian) {
  Random random(61);
  for (int i = 0; i < 20; ++i) {
    expect_both_ways(random_step(random, 3, 2, {1, 2, 1, 3}));
    expect_both_ways(random_step(random, 2, 1, {1, 1, 1, 1, 1, 1}));
    expect_both_ways(random_step(random, 4, 0, {2, 2}));
    expect_both_ways(random_step(random, 1, 0, {1}));
  }
}

TEST(CompositeStep, TakesSingularTransitionsAndCovariances) {
  Random random(62);
  StepCase c = random_step(random, 3, 1, {1, 2, 1});
  c.legs[1].F.row(2) = 2.0 * c.legs[1].F.row(0);
  c.legs[2].F.setZero();
  c.legs[3].Q.setZero();
  const VectorXd direction = random_matrix(random, 3, 1);
  c.P = direction * direction.transpose();
  const VectorXd other = random_matrix(random, 3, 1);
  c.legs[0].Q = other * other.transpose();
  expect_both_ways(c);
}

TEST(CompositeStep, WithoutObservationsOnlyPredicts) {
  Random random(63);
  expect_both_ways(random_step(random, 3, 2, {}));
}

TEST(CompositeStep, RefusesACovarianceThatOverflowsWhereTheMeanDoesNot) {
  Random random(66);
  StepCase c = random_step(random, 2, 0, {});
  c.x.setZero();
  c.legs[0].F = 1e200 * MatrixXd::Identity(2, 2);
  const CompositeStep step(c.legs, c.observations);
  StepUpdate out;
  EXPECT_EQ(step.composite(c.x, c.P, c.z, c.u, out), Status::numerical);
  EXPECT_EQ(step.sequential(c.x, c.P, c.z, c.u, out), Status::numerical);
}

TEST(CompositeStep, TakesAFullUpsilon) {
  Random random(64);
  for (int i = 0; i < 20; ++i) {
    StepCase c = random_step(random, 3, 1, {1, 2, 2});
    c.Upsilon = random_covariance(random, 5);
    const CompositeStep step(c.legs, c.observations, c.Upsilon);
    EXPECT_FALSE(step.separable());
    StepUpdate actual;
    ASSERT_EQ(step.composite(c.x, c.P, c.z, c.u, actual), Status::ok);
    expect_equal(actual, brute_force(c));
  }
}

TEST(CompositeStep, TakesItsBlocksFromABlockDiagonalUpsilon) {
  Random random(65);
  StepCase c = random_step(random, 3, 1, {1, 2, 2});
  c.Upsilon *= 7.0;
  const CompositeStep step(c.legs, c.observations, c.Upsilon);
  ASSERT_TRUE(step.separable());
  StepUpdate actual;
  ASSERT_EQ(step.sequential(c.x, c.P, c.z, c.u, actual), Status::ok);
  expect_equal(actual, brute_force(c));
}

TEST(CompositeStep, GivesGammaAndTheCrossCovariance) {
  Random random(66);
  const StepCase c = random_step(random, 3, 1, {2, 1});
  const StepReference expected = brute_force(c);
  const CompositeStep step(c.legs, c.observations);
  EXPECT_LT(error(step.Gamma(c.P), expected.Gamma), 1e-13);
  EXPECT_LT(error(step.cross_covariance(c.P), expected.C), 1e-13);
}

TEST(CompositeStep, TheNoiseIsUpsilonGammaInverseInnovation) {
  Random random(67);
  StepCase c = random_step(random, 2, 0, {1, 1, 1, 1});
  c.Upsilon = random_covariance(random, 4);
  const CompositeStep step(c.legs, c.observations, c.Upsilon);
  StepUpdate actual;
  ASSERT_EQ(step.composite(c.x, c.P, c.z, c.u, actual), Status::ok);
  const Eigen::LLT<MatrixXd> Gamma(step.Gamma(c.P));
  EXPECT_LT(error(actual.noise, c.Upsilon * Gamma.solve(actual.innovation)), 1e-12);  // (25)
  const MatrixXd covariance = c.Upsilon * Gamma.solve(c.Upsilon);                     // (26)
  EXPECT_LT(error(actual.noise_variance, covariance.diagonal()), 1e-12);
  EXPECT_NEAR(actual.sse, actual.innovation.dot(Gamma.solve(actual.innovation)), 1e-12);
}

TEST(CompositeStep, RefusesCovariancesThatAreNone) {
  Random random(68);
  const StepCase good = random_step(random, 2, 0, {1, 2});
  const auto answer = [](const StepCase& c) {
    const CompositeStep step(c.legs, c.observations, c.Upsilon);
    StepUpdate out;
    return step.composite(c.x, c.P, c.z, c.u, out);
  };
  ASSERT_EQ(answer(good), Status::ok);
  StepCase bad = good;
  bad.Upsilon(1, 1) = -1.0;
  EXPECT_EQ(answer(bad), Status::numerical);
  bad = good;
  bad.P(0, 0) = -1.0;
  EXPECT_EQ(answer(bad), Status::numerical);
  bad = good;
  bad.legs[1].Q(1, 1) = -1.0;
  EXPECT_EQ(answer(bad), Status::numerical);
  bad = good;
  bad.P << 1.0, 2.0, 2.0, 1.0;  // a correlation of 2
  EXPECT_EQ(answer(bad), Status::numerical);
  bad = good;
  bad.P << 0.0, 1.0, 1.0, 1.0;  // a variance of zero with a covariance
  EXPECT_EQ(answer(bad), Status::numerical);
  bad = good;
  bad.z(0) = std::nan("");
  EXPECT_EQ(answer(bad), Status::numerical);
}

TEST(CompositeStep, TheSequentialWayRefusesThemToo) {
  Random random(69);
  const StepCase good = random_step(random, 2, 0, {1, 2});
  const auto answer = [](const StepCase& c) {
    const CompositeStep step(c.legs, c.observations);
    StepUpdate out;
    return step.sequential(c.x, c.P, c.z, c.u, out);
  };
  ASSERT_EQ(answer(good), Status::ok);
  StepCase bad = good;
  bad.observations[1].R(1, 1) = -1.0;
  EXPECT_EQ(answer(bad), Status::numerical);
  bad = good;
  bad.P = -100.0 * MatrixXd::Identity(2, 2);
  EXPECT_EQ(answer(bad), Status::numerical);
  bad = good;
  bad.z(0) = std::nan("");
  EXPECT_EQ(answer(bad), Status::numerical);
}

}  // namespace
}  // namespace surefix::desync
