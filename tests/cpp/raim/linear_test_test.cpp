#include "surefix/raim/linear_test.hpp"

#include <gtest/gtest.h>

#include "raim/epochs.hpp"
#include "surefix/raim/affine_fit.hpp"
#include "surefix/raim/power.hpp"

namespace surefix::raim {
namespace {

using test::Random;

Eigen::MatrixXd random_matrix(int rows, int columns, Random& random) {
  Eigen::MatrixXd out(rows, columns);
  for (int j = 0; j < columns; ++j)
    for (int i = 0; i < rows; ++i) out(i, j) = random.normal();
  return out;
}

TEST(LinearTest, DoesNotSeeTheNuisance) {
  Random random(1);
  const Eigen::MatrixXd H = random_matrix(8, 3, random), none(8, 0);
  const Eigen::MatrixXd L = Eigen::VectorXd::LinSpaced(8, 0.5, 4.0).asDiagonal();
  LinearTest test;
  ASSERT_EQ(LinearTest::make(H, none, L, test), ConfigStatus::ok);
  EXPECT_EQ(test.rank(), 3);
  EXPECT_EQ(test.degrees(), 5);
  EXPECT_LT((test.W() * test.whitening() * H).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((test.W() * test.W().transpose() - Eigen::MatrixXd::Identity(5, 5)).norm(), 1e-14);
  const Eigen::VectorXd y = random_matrix(8, 1, random), x = random_matrix(3, 1, random);
  const Eigen::VectorXd moved = y + H * x;
  EXPECT_NEAR(test.statistic(y.data()), test.statistic(moved.data()), 1e-12);
  Eigen::VectorXd z(5);
  test.parity(y.data(), z.data());
  EXPECT_NEAR(test.statistic(y.data()), z.squaredNorm(), 1e-12);
}

TEST(LinearTest, CountsTheRanksOfBoth) {
  Random random(2);
  Eigen::MatrixXd H = random_matrix(8, 4, random), M = random_matrix(8, 3, random);
  H.col(3) = H.col(0) - 2.0 * H.col(1);
  M.col(2) = M.col(0) + H.col(1);  // of which H hides a part
  LinearTest test;
  ASSERT_EQ(LinearTest::make(H, M, Eigen::MatrixXd::Identity(8, 8), test), ConfigStatus::ok);
  EXPECT_EQ(test.rank(), 3);
  EXPECT_EQ(test.degrees(), 2);
  const Eigen::VectorXd hidden = H.col(0);
  EXPECT_LT(test.statistic(hidden.data()), 1e-25);
  ASSERT_EQ(LinearTest::make(H, H, Eigen::MatrixXd::Identity(8, 8), test), ConfigStatus::ok);
  EXPECT_EQ(test.degrees(), 0);
  EXPECT_EQ(LinearTest::make(H, M, Eigen::MatrixXd::Zero(8, 8), test), ConfigStatus::not_positive);
  EXPECT_EQ(LinearTest::make(H, M, Eigen::MatrixXd::Identity(7, 7), test),
            ConfigStatus::wrong_size);
}

TEST(AffineFit, MinimaxAlternatesWhereLeastSquaresDoesNot) {
  // x² on [−1, 1]: the best affine function is 1/2, its error 1/2 at −1, 0 and 1.
  Eigen::MatrixXd X(201, 1), values(201, 2);
  for (int i = 0; i < 201; ++i) {
    X(i, 0) = -1.0 + 0.01 * i;
    values(i, 0) = X(i, 0) * X(i, 0);
    values(i, 1) = std::exp(X(i, 0));
  }
  const AffineFit best = fit_minimax(X, values), plain = fit_least_squares(X, values);
  EXPECT_NEAR(best.rho(0), 0.5, 1e-12);
  EXPECT_NEAR(best.B(0), 0.5, 1e-12);
  EXPECT_NEAR(best.A(0, 0), 0.0, 1e-12);
  EXPECT_GT(plain.rho(0), 0.6);
  // e^x: slope sinh 1, error (e − x₁ sinh 1 …)/2 by Chebyshev, at the samples.
  EXPECT_NEAR(best.A(1, 0), std::sinh(1.0), 1e-9);
  const double touch = std::log(std::sinh(1.0));
  const double level = 0.5 * (std::exp(1.0) - std::sinh(1.0) - std::sinh(1.0) * (1.0 - touch));
  EXPECT_NEAR(best.rho(1), level, 2e-5);
  EXPECT_LT(best.rho(1), plain.rho(1));
}

TEST(ChiSquaredTest, BoundsItsPower) {
  const ChiSquaredTest test = chi_squared_test(1e-5, 6);
  EXPECT_NEAR(test.power(0.0), 1e-5, 1e-16);
  EXPECT_NEAR(test.power(50.0) + test.missed(50.0), 1.0, 1e-14);
  EXPECT_EQ(test.loss(30.0, 0.0), 0.0);
  EXPECT_NEAR(test.loss(30.0, 0.5), test.power(30.0) - test.least_power(30.0, 0.5), 1e-15);
  EXPECT_NEAR(test.gain(0.0, 0.5), test.power(0.25) - 1e-5, 1e-18);
  EXPECT_EQ(test.least_power(0.2, 1.0), test.power(0.0));
  for (double lambda = 0.0; lambda < 200.0; lambda += 0.5) {
    EXPECT_LE(test.loss(lambda, 0.5), test.worst_loss(0.5) * (1 + 1e-9));
    EXPECT_LE(test.gain(lambda, 0.5), test.worst_gain(0.5) * (1 + 1e-9));
  }
}

TEST(LinearTest, StaysAsItWasWhereItIsRefused) {
  Random random(3);
  const Eigen::MatrixXd H = random_matrix(5, 2, random), M = random_matrix(5, 1, random);
  const Eigen::MatrixXd L = Eigen::MatrixXd::Identity(5, 5), none(5, 0);
  LinearTest test;
  ASSERT_EQ(LinearTest::make(H, none, L, test), ConfigStatus::ok);
  const auto made = [&](const Eigen::MatrixXd& h, const Eigen::MatrixXd& m,
                        const Eigen::MatrixXd& l) { return LinearTest::make(h, m, l, test); };
  EXPECT_EQ(made(Eigen::MatrixXd(0, 2), none, Eigen::MatrixXd(0, 0)), ConfigStatus::wrong_size);
  EXPECT_EQ(made(H, none, Eigen::MatrixXd::Identity(5, 4)), ConfigStatus::wrong_size);
  EXPECT_EQ(made(H.topRows(4), none, L), ConfigStatus::wrong_size);
  EXPECT_EQ(made(H, M.topRows(4), L), ConfigStatus::wrong_size);
  Eigen::MatrixXd bad_H = H, bad_M = M, bad_L = L;
  bad_H(4, 1) = std::nan("");
  bad_M(0, 0) = std::numeric_limits<double>::infinity();
  bad_L(3, 2) = std::nan("");
  EXPECT_EQ(made(bad_H, M, L), ConfigStatus::not_finite);
  EXPECT_EQ(made(H, bad_M, L), ConfigStatus::not_finite);
  EXPECT_EQ(made(H, M, bad_L), ConfigStatus::not_finite);
  EXPECT_EQ(made(H, none, 1e-320 * L), ConfigStatus::not_finite);  // 1/L overflows
  EXPECT_EQ(test.size(), 5);
  EXPECT_EQ(test.rank(), 2);
  EXPECT_EQ(test.degrees(), 3);
  EXPECT_EQ(test.whitening(), L);
}

TEST(AffineFit, MinimaxInTwoDimensions) {
  // Symmetric in both, so that ties abound: the best fit to x² + y² on [−1, 1]² is 1, to xy it is
  // 0, both with an error of 1 in five and in four places.
  constexpr int side = 21;
  Eigen::MatrixXd X(side * side, 2), values(side * side, 3);
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const double x = 0.1 * (i - 10), y = 0.1 * (j - 10);
      X.row(i * side + j) << x, y;
      values.row(i * side + j) << x * x + y * y, x * y, 3.0 - x + 2.0 * y;
    }
  const AffineFit best = fit_minimax(X, values), plain = fit_least_squares(X, values);
  EXPECT_NEAR(best.rho(0), 1.0, 1e-9);
  EXPECT_NEAR(best.B(0), 1.0, 1e-9);
  EXPECT_GT(plain.rho(0), 1.2);
  EXPECT_NEAR(best.rho(1), 1.0, 1e-9);
  EXPECT_LT(best.rho(2), 1e-13);
  EXPECT_NEAR(best.A(2, 1), 2.0, 1e-13);
  for (int c = 0; c < 3; ++c) {
    const Eigen::VectorXd left = values.col(c) - X * best.A.row(c).transpose() -
                                 Eigen::VectorXd::Constant(side * side, best.B(c));
    EXPECT_NEAR(left.cwiseAbs().maxCoeff(), best.rho(c), 1e-12) << c;
  }
}

TEST(AffineFit, SamplesOnALineAndValuesThatAreNone) {
  // The second coordinate never moves: the samples span no plane, and a fit is one all the same.
  Eigen::MatrixXd X(41, 2), values(41, 2);
  for (int i = 0; i < 41; ++i) {
    X.row(i) << 0.05 * (i - 20), 7.0;
    values.row(i) << X(i, 0) * X(i, 0), i == 3 ? std::nan("") : 1.0;
  }
  const AffineFit best = fit_minimax(X, values), plain = fit_least_squares(X, values);
  EXPECT_LE(best.rho(0), plain.rho(0));
  EXPECT_GE(best.rho(0), 0.5 - 1e-12);
  EXPECT_FALSE(best.rho(1) >= 0.0);
}

TEST(AffineFit, WhereSamplesAreRepeatedAndExchangesTie) {
  // Two values at one place: half their difference is left, whatever is done elsewhere.
  Eigen::MatrixXd X(4, 1), values(4, 1);
  X << 0.0, 1.0, 1.0, 0.0;
  values << 0.0, 2.0, -2.0, 0.0;
  const AffineFit best = fit_minimax(X, values);
  EXPECT_NEAR(best.rho(0), 2.0, 1e-14);
  EXPECT_NEAR(best.A(0, 0) + best.B(0), 0.0, 1e-14);  // the only fit between the two
  EXPECT_LE(std::abs(best.B(0)), 2.0 + 1e-14);
}

TEST(AffineFit, WhereTheExchangeDoesNotEndItIsNoWorse) {
  // Coordinates that differ by rounding only: samples are exchanged for ever, were there no bound.
  Random random(4);
  for (int round = 0; round < 10; ++round) {
    const Eigen::MatrixXd noise = random_matrix(40, 1, random);
    Eigen::MatrixXd X(40, 2);
    X.col(0) = random_matrix(40, 1, random);
    X.col(1) = X.col(0) + 1e-13 * noise;
    const Eigen::MatrixXd values = random_matrix(40, 3, random);
    const AffineFit best = fit_minimax(X, values), plain = fit_least_squares(X, values);
    for (int c = 0; c < 3; ++c) {
      EXPECT_GT(best.rho(c), 0.0);
      EXPECT_LE(best.rho(c), plain.rho(c) * (1.0 + 1e-12)) << round;
    }
  }
}

TEST(LinearTest, TakesAnyUnitOfTheMeasurementsOrRefusesIt) {
  Random random(23);
  const Eigen::MatrixXd H = random_matrix(5, 2, random), M = random_matrix(5, 1, random);
  Eigen::VectorXd y(5);
  for (int i = 0; i < 5; ++i) y(i) = random.normal();
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(5, 5);
  LinearTest usual, test;
  ASSERT_EQ(LinearTest::make(H, M, I, usual), ConfigStatus::ok);
  for (const double unit : {1e-200, 1e200}) {  // whose squares are no numbers
    ASSERT_EQ(LinearTest::make(H, M, unit * I, test), ConfigStatus::ok) << unit;
    EXPECT_EQ(test.rank(), usual.rank());
    EXPECT_EQ(test.degrees(), usual.degrees());
    const Eigen::VectorXd same = unit * y;
    EXPECT_NEAR(test.statistic(same.data()) / usual.statistic(y.data()), 1.0, 1e-12) << unit;
  }
  EXPECT_EQ(LinearTest::make(H, M, 1e-320 * I, test), ConfigStatus::not_finite);  // 1/1e-320
  // Σ^{-1/2} = 1.7e308 (1 0; 1 1): finite, but its projection off H = (1, −2) is not, nor is that
  // onto a fault which shows in both measurements alike.
  const Eigen::MatrixXd steep =
      (Eigen::Matrix2d() << 1.0, 0.0, -1.0, 1.0).finished() * (1.0 / 1.7e308);
  const Eigen::MatrixXd state = 1e-300 * Eigen::Vector2d(1.0, -2.0);
  const Eigen::MatrixXd fault = 1e-300 * Eigen::Vector2d(1.0, 0.0), none(2, 0);
  EXPECT_EQ(LinearTest::make(state, none, steep, test), ConfigStatus::not_finite);
  EXPECT_EQ(LinearTest::make(none, fault, steep, test), ConfigStatus::not_finite);
  EXPECT_EQ(test.degrees(), usual.degrees());
}

}  // namespace
}  // namespace surefix::raim
