#include "surefix/switching/mode_chain.hpp"

#include <gtest/gtest.h>

namespace surefix::switching {
namespace {

using What = ChainStatus::What;

Eigen::MatrixXd two(double fail, double repair) {
  Eigen::MatrixXd P(2, 2);
  P << 1.0 - fail, fail, repair, 1.0 - repair;
  return P;
}

const std::vector<Mode> kTwo{{1.0, 1.0}, {0.0, 1.0}};

TEST(ModeChain, StationaryLawKeepsTheDigitsOfARareMode) {
  Eigen::VectorXd law;
  for (const double fail : {0.3, 1e-9, 1e-300}) {
    ASSERT_TRUE(stationary(two(fail, 0.5), law));
    EXPECT_NEAR(law(1), fail / (fail + 0.5), 1e-15 * law(1));
    EXPECT_DOUBLE_EQ(law.sum(), 1.0);
  }
}

TEST(ModeChain, TransientModesHaveNoStationaryProbability) {
  Eigen::MatrixXd P(3, 3);
  P << 0.5, 0.25, 0.25, 0.0, 0.9, 0.1, 0.0, 0.3, 0.7;
  Eigen::VectorXd law;
  ASSERT_TRUE(stationary(P, law));
  EXPECT_EQ(law(0), 0.0);
  EXPECT_NEAR(law(1), 0.75, 1e-15);
}

TEST(ModeChain, TwoClassesHaveNoSingleLaw) {
  Eigen::VectorXd law;
  EXPECT_EQ(stationary(Eigen::MatrixXd::Identity(2, 2), law).what, What::reducible);
  ModeChain chain;
  EXPECT_EQ(ModeChain::make(kTwo, Eigen::MatrixXd::Identity(2, 2), {}, chain).what,
            What::reducible);
  EXPECT_EQ(chain.size(), 0);
}

TEST(ModeChain, SaysWhereItIsNoChain) {
  ModeChain chain;
  Eigen::MatrixXd P = two(0.1, 0.2);
  P(1, 0) = 0.3;
  ChainStatus status = ModeChain::make(kTwo, P, {}, chain);
  EXPECT_EQ(status.what, What::row_sum);
  EXPECT_EQ(status.row, 1);
  EXPECT_DOUBLE_EQ(status.value, 1.1);
  P(1, 0) = -0.1;
  status = ModeChain::make(kTwo, P, {}, chain);
  EXPECT_EQ(status.what, What::negative);
  EXPECT_EQ(status.column, 0);
  EXPECT_EQ(ModeChain::make({{1.0, 1.0}}, two(0.1, 0.2), {}, chain).what, What::wrong_size);
  EXPECT_EQ(ModeChain::make({{1.0, 1.0}, {1.0, 0.0}}, two(0.1, 0.2), {}, chain).what, What::delta);
  EXPECT_EQ(ModeChain::make({{HUGE_VAL, 1.0}, {1.0, 1.0}}, two(0.1, 0.2), {}, chain).what,
            What::gamma);
  EXPECT_EQ(ModeChain::make(kTwo, two(0.1, 0.2), Eigen::Vector2d(0.5, 0.6), chain).what,
            What::initial);
  P(1, 0) = std::nan("");
  EXPECT_EQ(ModeChain::make(kTwo, P, {}, chain).what, What::negative);
  EXPECT_EQ(ModeChain::make(kTwo, two(0.1, 0.2).leftCols(1), {}, chain).what, What::wrong_size);
  EXPECT_EQ(ModeChain::make({}, Eigen::MatrixXd(), {}, chain).what, What::wrong_size);
  EXPECT_EQ(ModeChain::make({{1.0, HUGE_VAL}}, two(0.1, 0.2), {}, chain).what, What::delta);
  EXPECT_EQ(ModeChain::make(kTwo, two(0.1, 0.2), Eigen::Vector3d(1.0, 0.0, 0.0), chain).what,
            What::wrong_size);
  EXPECT_EQ(chain.size(), 0);
}

TEST(ModeChain, OfTwoIndependentOnesIsTheirProduct) {
  ModeChain chain;
  ASSERT_TRUE(ModeChain::independent({1.0, 0.0}, two(0.1, 0.4), {1.0, 10.0}, two(0.3, 0.5), chain));
  ASSERT_EQ(chain.size(), 4);
  EXPECT_EQ(chain.gamma[2], 0.0);
  EXPECT_EQ(chain.branches[1].front().delta, 10.0);
  EXPECT_DOUBLE_EQ(chain.transition(0, 3), 0.1 * 0.3);
  EXPECT_DOUBLE_EQ(chain.transition(3, 0), 0.4 * 0.5);
  EXPECT_NEAR(chain.initial(3), 0.2 * 0.375, 1e-15);
  EXPECT_LT((chain.transition.transpose() * chain.initial - chain.initial).norm(), 1e-15);
}

TEST(ModeChain, OfTwoRefusesWhatEitherRefuses) {
  ModeChain chain;
  const auto made = [&](const Eigen::MatrixXd& gamma, const Eigen::MatrixXd& delta) {
    return ModeChain::independent({1.0, 0.0}, gamma, {1.0, 10.0}, delta, chain).what;
  };
  const Eigen::MatrixXd good = two(0.1, 0.4), never = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1), halves = 0.5 * good;
  EXPECT_EQ(made(one, good), What::wrong_size);
  EXPECT_EQ(made(good, one), What::wrong_size);
  EXPECT_EQ(made(halves, good), What::row_sum);
  EXPECT_EQ(made(good, halves), What::row_sum);
  EXPECT_EQ(made(never, good), What::reducible);
  EXPECT_EQ(made(good, never), What::reducible);
  EXPECT_EQ(chain.size(), 0);
}

TEST(ModeChain, LumpsInterruptedModesOnly) {
  ModeChain chain, lumped;
  ASSERT_TRUE(ModeChain::independent({1.0, 0.0}, two(0.1, 0.4), {1.0, 10.0}, two(0.3, 0.5), chain));
  ASSERT_TRUE(chain.lumped({{0}, {1}, {2, 3}}, chain.initial, lumped));
  EXPECT_EQ(lumped.size(), 3);
  ASSERT_EQ(lumped.branches[2].size(), 2u);
  EXPECT_NEAR(lumped.branches[2][1].share, 0.375, 1e-15);
  EXPECT_NEAR(lumped.transition(2, 2), 0.6, 1e-15);
  EXPECT_NEAR(lumped.transition(0, 2), 0.1, 1e-15);
  ChainStatus status = chain.lumped({{0, 1}, {2}, {3}}, chain.initial, lumped);
  EXPECT_EQ(status.what, What::lumped);
  EXPECT_EQ(status.row, 0);
  EXPECT_EQ(chain.lumped({{0}, {1}, {2}}, chain.initial, lumped).row, 3);
  EXPECT_EQ(chain.lumped({{0}, {1}, {2, 3}, {3}}, chain.initial, lumped).row, 3);
  for (const int unknown : {-1, 4}) {
    status = chain.lumped({{0}, {1}, {2, 3, unknown}}, chain.initial, lumped);
    EXPECT_EQ(status.what, What::lumped);
    EXPECT_EQ(status.row, unknown);
  }
  EXPECT_EQ(lumped.size(), 3);
}

TEST(ModeChain, TransitionsOfRates) {
  Eigen::MatrixXd rates(2, 2), P;
  rates << 0.0, 0.2, 0.5, 0.0;
  ASSERT_EQ(transition_over(rates, 2.0, P), ConfigStatus::ok);
  EXPECT_NEAR(P(0, 1), 0.2 / 0.7 * (1.0 - std::exp(-1.4)), 1e-15);
  EXPECT_EQ(transition_over(rates, -1.0, P), ConfigStatus::negative);
  EXPECT_EQ(transition_over(rates, HUGE_VAL, P), ConfigStatus::not_finite);
  EXPECT_EQ(transition_over(rates.topRows(1), 1.0, P), ConfigStatus::wrong_size);
  EXPECT_EQ(transition_over(Eigen::MatrixXd(), 1.0, P), ConfigStatus::wrong_size);
  const Eigen::MatrixXd before = P;
  rates(0, 1) = -0.2;
  EXPECT_EQ(transition_over(rates, 2.0, P), ConfigStatus::negative);
  rates(0, 1) = std::nan("");
  EXPECT_EQ(transition_over(rates, 2.0, P), ConfigStatus::not_finite);
  EXPECT_EQ(P, before);
}

}  // namespace
}  // namespace surefix::switching
