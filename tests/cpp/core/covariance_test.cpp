// The promise about P: exactly symmetric and never negative, whatever comes.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "bits.hpp"
#include "dense.hpp"
#include "surefix/core/update.hpp"
#include "surefix/desync/recursion.hpp"
#include "systems.hpp"

namespace surefix {
namespace {

using namespace test;

/// 1 − ρ² of a 2 × 2 covariance, without the cancellation of P₀₀ P₁₁ − P₀₁².
double decorrelation(const Eigen::Matrix2d& P) {
  const double product = P(0, 0) * P(1, 1), square = P(0, 1) * P(0, 1);
  const double product_rest = std::fma(P(0, 0), P(1, 1), -product);
  const double square_rest = std::fma(P(0, 1), P(0, 1), -square);
  return ((product - square) + (product_rest - square_rest)) / product;
}

/// Two variances of any size and a correlation with 1 − ρ² down to 1e-12.
Eigen::Matrix2d ill_conditioned(Random& random) {
  const double a = random.log_uniform(1e-3, 1e3), b = random.log_uniform(1e-3, 1e3);
  const double rho = std::sqrt(1.0 - random.log_uniform(1e-12, 1.0));
  const double sign = random.uniform() < 0.5 ? -1.0 : 1.0;
  return Eigen::Matrix2d{{a * a, sign * rho * a * b}, {sign * rho * a * b, b * b}};
}

// ── Of a configuration ─────────────────────────────────────────────────────────────────────────

/// As a matrix of fixed size, of one known at run time, and as a belief's.
ConfigStatus check(const Eigen::Matrix3d& P) {
  const Gaussian<3> fixed{Eigen::Vector3d::Zero(), P};
  const Gaussian<Eigen::Dynamic, double, 40> bounded{Eigen::VectorXd::Zero(3), P};
  EXPECT_EQ(fixed.check(), check_covariance(P));
  EXPECT_EQ(bounded.check(), check_covariance(P));
  return check_covariance(P);
}

ConfigStatus check(std::initializer_list<std::initializer_list<double>> P) {
  return check(Eigen::Matrix3d(P));
}

TEST(Covariance, IsOkIfSymmetricAndSemidefiniteInAnyUnits) {
  EXPECT_EQ(check(Eigen::Matrix3d::Zero()), ConfigStatus::ok);
  EXPECT_EQ(check(Eigen::Matrix3d::Identity()), ConfigStatus::ok);
  EXPECT_EQ(check({{1, 2, 3}, {2, 4, 6}, {3, 6, 9}}), ConfigStatus::ok) << "of rank one";
  EXPECT_EQ(check({{1, 0, 1}, {0, 0, 0}, {1, 0, 1}}), ConfigStatus::ok) << "of rank one";
  EXPECT_EQ(check({{1e300, 9e-1, 0}, {9e-1, 1e-300, 0}, {0, 0, 5e-324}}), ConfigStatus::ok);
  Random random(23);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d a = random_matrix(random, 3, 1), b = random_matrix(random, 3, 1);
    const Eigen::DiagonalMatrix<double, 3> units(1.0, random.log_uniform(1e-60, 1e60), 1e-9);
    Eigen::Matrix3d P = a * a.transpose() + random.log_uniform(1e-20, 1.0) * b * b.transpose();
    P = units * P * units;
    mirror(P);
    EXPECT_EQ(check(P), ConfigStatus::ok) << P;
  }
}

TEST(Covariance, OfTheLargestBeliefIsChecked) {
  Random random(24);
  using Belief = AnySystem::Belief;
  Belief belief{Eigen::VectorXd::Zero(40), random_covariance(random, 40)};
  EXPECT_EQ(belief.check(), ConfigStatus::ok);
  const Eigen::MatrixXd root = random_matrix(random, 40, 7);
  belief.P = root * root.transpose();
  mirror(belief.P);
  EXPECT_EQ(belief.check(), ConfigStatus::ok) << "of rank seven";
  belief.P(39, 39) *= 1.0 - 1e-6;
  EXPECT_EQ(belief.check(), ConfigStatus::not_semidefinite);
}

TEST(Covariance, IsRefusedIfItIsNone) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (double bad : {infinity, -infinity, std::nan("")}) {
    EXPECT_EQ(check({{bad, 0, 0}, {0, 1, 0}, {0, 0, 1}}), ConfigStatus::not_finite);
    EXPECT_EQ(check({{1, bad, 0}, {bad, 1, 0}, {0, 0, 1}}), ConfigStatus::not_finite);
  }
  constexpr ConfigStatus none = ConfigStatus::not_semidefinite;
  EXPECT_EQ(check({{1, 0.1, 0}, {0.1 + 1e-16, 1, 0}, {0, 0, 1}}), none) << "not symmetric";
  EXPECT_EQ(check({{1, 0, 0}, {0, -1e-300, 0}, {0, 0, 1}}), none) << "a negative variance";
  EXPECT_EQ(check({{1, 1.0001, 0}, {1.0001, 1, 0}, {0, 0, 1}}), none) << "a correlation over one";
  EXPECT_EQ(check({{1, 1e-5, 0}, {1e-5, 0, 0}, {0, 0, 1}}), none) << "correlated with nothing";
  EXPECT_EQ(check({{1, 1, 1}, {1, 1, -1}, {1, -1, 1}}), none) << "no negative pivot at first";
  EXPECT_EQ(check({{1, 1, 1}, {1, 1, 1.001}, {1, 1.001, 1}}), none) << "what is left has no pivot";
  EXPECT_EQ(check({{1, 1e300, 0}, {1e300, 1, 0}, {0, 0, 1}}), none);
  EXPECT_EQ(check({{1, -0.5001, -0.5}, {-0.5001, 1, -0.5}, {-0.5, -0.5, 1}}), none);
  EXPECT_EQ(check({{1, -0.5, -0.5}, {-0.5, 1, -0.5}, {-0.5, -0.5, 1}}), ConfigStatus::ok);
}

TEST(Covariance, OfAnotherSizeThanTheMeanIsRefused) {
  using Belief = Gaussian<Eigen::Dynamic, double, 8>;
  const auto check_sizes = [](int mean, int rows, int columns) {
    return Belief{Eigen::VectorXd::Zero(mean), Eigen::MatrixXd::Zero(rows, columns)}.check();
  };
  EXPECT_EQ(check_sizes(2, 2, 2), ConfigStatus::ok);
  EXPECT_EQ(check_sizes(3, 2, 2), ConfigStatus::wrong_size);
  EXPECT_EQ(check_sizes(2, 2, 3), ConfigStatus::wrong_size);
  Gaussian<2> belief{{0.0, std::nan("")}, Eigen::Matrix2d::Identity()};
  EXPECT_EQ(belief.check(), ConfigStatus::not_finite) << "the mean";
}

// ── Of a filter under way ──────────────────────────────────────────────────────────────────────

TEST(Covariance, OfTheSpeedModelIsNeverNegativeInAMillionSteps) {
  Random random(19);
  Gaussian<2> belief{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Identity()};
  double worst = 1.0, smallest = 1.0;
  int asymmetric = 0, refused = 0;
  for (int step = 0; step < 1'000'000; ++step) {
    if (step % 20 == 0) belief.P = ill_conditioned(random);
    const ConstantAcceleration model(random.log_uniform(1e-6, 1.0));
    ChainTransition<2> transition;
    const double longest = step % 1000 == 999 ? 3e16 : 1e11;
    (void)model.transition(static_cast<Time>(random.log_uniform(1e6, longest)), transition);
    const Gaussian<2> before = belief;
    predict(belief, transition);
    if (decorrelation(belief.P) < 1e-12) {  // an ill-conditioned P moved beyond the claim
      belief = before;
      continue;
    }
    smallest = std::min(smallest, decorrelation(belief.P));
    Innovation<Gaussian<2>> out;
    const double r = random.log_uniform(1e-6, 1e3);
    refused += !update(belief, ComponentRow<0>{}, r, random.normal(), out);
    asymmetric += belief.P(0, 1) != belief.P(1, 0);
    if (!(belief.P(0, 0) > 0.0 && belief.P(1, 1) > 0.0)) worst = -1.0;
    worst = std::min(worst, decorrelation(belief.P));
  }
  EXPECT_LT(smallest, 2e-12) << "the test does not reach the condition number that it claims";
  EXPECT_GE(worst, 0.0);
  EXPECT_EQ(asymmetric, 0);
  EXPECT_EQ(refused, 0);
}

/// One run, P never set again. Again and again a precise reading after a gap of months leaves the
/// speed known and the acceleration free; microseconds later all that is unknown of the speed is
/// what is unknown of the acceleration (1 − ρ² near 1e-12), and the next reading takes that away.
TEST(Covariance, OfTheSpeedModelIsNeverNegativeInOneRunOfTenMillionSteps) {
  constexpr int steps = 10'000'000, kinds = 1024;
  Random random(25);
  const ConstantAcceleration model(0.08);
  ChainTransition<2> gap[kinds], moment[kinds];
  double precise[kinds];
  for (int i = 0; i < kinds; ++i) {  // drawn once: a logarithm costs more than a step
    (void)model.transition(static_cast<Time>(random.log_uniform(1e14, 1e16)), gap[i]);
    (void)model.transition(static_cast<Time>(random.log_uniform(1e4, 1e6)), moment[i]);
    precise[i] = random.log_uniform(1e-22, 1e-10);
  }
  Gaussian<2> belief{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Identity()};
  Innovation<Gaussian<2>> out;
  double worst = 1.0, smallest = 1.0;
  int asymmetric = 0, refused = 0, ill_conditioned_steps = 0;
  for (int step = 0; step < steps; ++step) {
    const int kind = random.integer(kinds);
    predict(belief, step % 2 == 0 ? gap[kind] : moment[kind]);
    const double before = decorrelation(belief.P);
    smallest = std::min(smallest, before);
    ill_conditioned_steps += before < 1e-11;
    refused +=
        !update(belief, ComponentRow<0>{}, precise[random.integer(kinds)], -belief.x(0), out);
    asymmetric += belief.P(0, 1) != belief.P(1, 0);
    if (!(belief.P(0, 0) > 0.0 && belief.P(1, 1) > 0.0)) worst = -1.0;
    worst = std::min(worst, decorrelation(belief.P));
  }
  EXPECT_LT(smallest, 2e-12) << "the test does not reach the condition number that it claims";
  EXPECT_GT(ill_conditioned_steps, 100'000);
  EXPECT_GE(worst, 0.0);
  EXPECT_EQ(asymmetric, 0);
  EXPECT_EQ(refused, 0);
}

TEST(Covariance, OfScaleAndBiasStatesIsNeverNegativeInAMillionSteps) {
  const AnySystem system = train_system();
  Random random(20);
  auto state = desync::start_state(broad(system, 20.0, 1e6), 0);
  desync::Record<AnySystem> record;
  double worst = 1.0, smallest = 1.0;
  int asymmetric = 0, refused = 0;
  for (int step = 0; step < 1'000'000; ++step) {
    if (step % 1000 == 0) state = desync::start_state(broad(system, 20.0, 1e6), 0);
    const Time elapsed = static_cast<Time>(random.log_uniform(1e6, step % 333 == 0 ? 1e12 : 1e10));
    const desync::Measurement m{state.time + elapsed, 20.0 + random.normal(), step,
                                random.integer(3)};
    refused += absorb(system, state, m, record) != Status::ok;
    const auto& P = state.belief.P;
    asymmetric += P != P.transpose();
    if (!(P.diagonal().minCoeff() > 0.0)) worst = -1.0;
    if (step % 20 != 0) continue;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(P, Eigen::EigenvaluesOnly);
    const auto& eigenvalues = solver.eigenvalues();
    smallest = std::min(smallest, eigenvalues(0) / eigenvalues(5));
    worst = std::min(worst, smallest_correlation_eigenvalue(P));
  }
  EXPECT_LT(smallest, 1e-10) << "the test does not reach the condition number that it claims";
  EXPECT_GE(worst, 0.0);
  EXPECT_EQ(asymmetric, 0);
  EXPECT_EQ(refused, 0);
}

TEST(Covariance, OfThePositionModelIsNeverNegative) {
  Random random(22);
  const ConstantAccelerationWithPosition model(0.1);
  Gaussian<3> belief{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  double worst = 1.0;
  for (int step = 0; step < 200'000; ++step) {
    if (step % 100 == 0) belief.P = random.log_uniform(1.0, 1e6) * Eigen::Matrix3d::Identity();
    ChainTransition<3> transition;
    const double longest = step % 250 == 249 ? 1e13 : 1e10;
    (void)model.transition(static_cast<Time>(random.log_uniform(1e7, longest)), transition);
    predict(belief, transition);
    Innovation<Gaussian<3>> out;
    const double r = random.log_uniform(1e-4, 1e2);
    ASSERT_TRUE(random.uniform() < 0.5 ? update(belief, ComponentRow<0>{}, r, 1.0, out)
                                       : update(belief, ComponentRow<1>{}, r, 1.0, out));
    ASSERT_TRUE(exactly_symmetric(belief.P));
    if (step % 4 == 0) worst = std::min(worst, smallest_correlation_eigenvalue(belief.P));
  }
  EXPECT_GE(worst, 0.0);
}

TEST(Covariance, AfterAYearsGapAndPreciseMeasurementsIsThatOfTheTextbook) {
  for (double q : {1e-3, 0.08, 1.0})
    for (double sigma : {1e-3, 0.1, 1.0}) {
      SpeedSystem system{ConstantAcceleration(q)};
      ASSERT_EQ(system.add(sensor<SpeedSystem>(Eigen::Vector2d{1.0, 0.0}, sigma)),
                ConfigStatus::ok);
      auto state = desync::start_state(broad(system), 0);
      Kalman expected(state.belief);
      desync::Record<SpeedSystem> record;
      Time time = 0;
      for (Time elapsed : {year, 100 * millisecond, 100 * millisecond, second, year, second}) {
        time += elapsed;
        ASSERT_EQ(absorb(system, state, {time, 20.0, 0, 0}, record), Status::ok);
        ChainTransition<2> transition;
        ASSERT_EQ(system.model().transition(elapsed, transition), Status::ok);
        expected.predict(dense(transition, 2));
        const Real innovation = 20.0L - expected.x(0);
        expected.update(Eigen::Vector2d{1.0, 0.0}, Real(sigma) * sigma, innovation);
        EXPECT_GE(decorrelation(state.belief.P), 0.0) << q << ", " << sigma;
        EXPECT_NEAR(state.belief.P(0, 0) / double(expected.P(0, 0)), 1.0, 1e-2);
        EXPECT_NEAR(state.belief.P(1, 1) / double(expected.P(1, 1)), 1.0, 1e-2);
      }
    }
}

}  // namespace
}  // namespace surefix
