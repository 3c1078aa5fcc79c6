#include "surefix/switching/linear_optimal.hpp"

#include <gtest/gtest.h>

#include "surefix/switching/any_filter.hpp"
#include "switching/switching.hpp"

namespace surefix::switching {
namespace {

ModeChain chain_of(double stay_healthy, double repair) {
  ModeChain chain;
  const Eigen::MatrixXd P =
      (Eigen::Matrix2d() << stay_healthy, 1.0 - stay_healthy, repair, 1.0 - repair).finished();
  EXPECT_TRUE(ModeChain::make({{1.0, 1.0}, {0.0, 1.0}}, P, {}, chain));
  return chain;
}

TEST(LinearOptimal, ConditionHoldsForEqualRowsOnly) {
  const ModeChain drawn = chain_of(0.8, 0.8), markov = chain_of(0.9, 0.4);
  const LinearCondition yes = check_linear(drawn, {drawn.transition}, 50);
  EXPECT_TRUE(yes.holds);
  EXPECT_NEAR(yes.p11, 0.8, 1e-15);
  const LinearCondition no = check_linear(markov, {markov.transition}, 50);
  EXPECT_FALSE(no.holds);
  EXPECT_NEAR(no.highest, 0.9, 1e-15);
  EXPECT_NEAR(no.lowest, 0.8, 1e-6);  // the stationary probability, after long
  EXPECT_EQ(no.lags, 49);
}

TEST(LinearOptimal, ConditionCountsFromTheFirstStepThatMayBeHealthy) {
  ModeChain chain;
  const Eigen::MatrixXd P = (Eigen::Matrix2d() << 0.9, 0.1, 0.4, 0.6).finished();
  ASSERT_TRUE(ModeChain::make({{1.0, 1.0}, {0.0, 1.0}}, P, Eigen::Vector2d(0.0, 1.0), chain));
  const LinearCondition never = check_linear(chain, {P}, 2);  // one step that is, none after it
  EXPECT_TRUE(never.holds);
  EXPECT_EQ(never.lags, 0);
  const LinearCondition once = check_linear(chain, {P}, 3);
  EXPECT_TRUE(once.holds);
  EXPECT_EQ(once.lags, 1);
  EXPECT_NEAR(once.p11, 0.9, 1e-15);
  EXPECT_FALSE(check_linear(chain, {P}, 4).holds);
}

TEST(LinearOptimal, ConditionForgetsLagsBeyond256) {
  const ModeChain markov = chain_of(0.9, 0.4);
  EXPECT_EQ(check_linear(markov, {markov.transition}, 256).lags, 255);
  const LinearCondition out = check_linear(markov, {markov.transition}, 400);
  EXPECT_EQ(out.lags, 256);
  EXPECT_NEAR(out.highest, 0.9, 1e-15);
  EXPECT_NEAR(out.lowest, 0.8, 1e-15);
}

TEST(LinearOptimal, HasNoGainWhereTheCovarianceOverflows) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  // The variance of the innovation is infinite, or the difference of two that are.
  for (const ModeChain& chain : {chain_of(0.8, 0.6), chain_of(0.9, 0.4)}) {
    LinearRecursion recursion(chain, Eigen::VectorXd::Zero(1), one, false);
    LinearGain gain;
    const LinearStep step{1e200 * one, one, one, one, {}};
    ASSERT_TRUE(recursion.advance(step, nullptr, nullptr, gain));
    EXPECT_FALSE(recursion.advance(step, &chain.transition, nullptr, gain));
  }
}

TEST(LinearOptimal, IsTheKalmanFilterWithoutFaults) {
  const LinearSystem system = testing::two_states();
  const ModeChain chain = chain_of(1.0, 0.5);
  LinearRecursion recursion(chain, Eigen::Vector2d::Zero(), system.P0, false);
  Eigen::MatrixXd P = system.P0;
  for (int k = 0; k < 20; ++k) {
    if (k > 0) P = system.A[0] * P * system.A[0].transpose() + system.Q[0];
    const Eigen::MatrixXd S = system.H[0] * P * system.H[0].transpose() + system.R[0];
    const Eigen::MatrixXd K = P * system.H[0].transpose() / S(0, 0);
    P -= K * S * K.transpose();
    LinearGain gain;
    ASSERT_TRUE(recursion.advance({system.A[0], system.Q[0], system.H[0], system.R[0], {}},
                                  k > 0 ? &chain.transition : nullptr, nullptr, gain));
    EXPECT_LT((gain.F2 - K).norm(), 1e-13);
    EXPECT_LT((recursion.error() - P).norm(), 1e-12);
    EXPECT_LT((recursion.error_if_optimal() - P).norm(), 1e-12);
  }
}

TEST(LinearOptimal, ReportsItsErrorWhetherOptimalOrNot) {
  const LinearSystem system = testing::two_states();
  for (const bool optimal : {true, false}) {
    const ModeChain chain = optimal ? chain_of(0.7, 0.7) : chain_of(0.95, 0.2);
    LinearRecursion recursion(chain, system.x0, system.P0, false);
    LinearGain gain;
    for (int k = 0; k < 10; ++k)
      ASSERT_TRUE(recursion.advance({system.A[0], system.Q[0], system.H[0], system.R[0], {}},
                                    k > 0 ? &chain.transition : nullptr, nullptr, gain));
    const double difference = (recursion.error() - recursion.error_if_optimal()).norm();
    EXPECT_EQ(difference < 1e-12, optimal) << difference;
  }
}

}  // namespace
}  // namespace surefix::switching
