#include "surefix/core/linear_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "bits.hpp"
#include "dense.hpp"
#include "systems.hpp"

namespace surefix {
namespace {

using namespace test;

using Model = LinearModel<3>;
using Bounded = LinearModel<Eigen::Dynamic, 8>;

template <class M>
FQ over(const M& model, Time elapsed) {
  typename M::Transition transition;
  EXPECT_EQ(model.transition(elapsed, transition), Status::ok);
  return {transition.F, transition.Q};
}

/// Eigenvalues −1000, −1 and −0.1 in skewed directions, noise on all.
struct Stiff {
  Eigen::Matrix3d A, W;
  Stiff() {
    const Eigen::Matrix3d V{{1.0, 0.3, -0.2}, {0.1, 1.0, 0.4}, {-0.3, 0.2, 1.0}};
    const Eigen::Vector3d eigenvalues{-1000.0, -1.0, -0.1};
    A = V * eigenvalues.asDiagonal() * V.inverse();
    W << 2.0, 0.5, 0.1, 0.5, 1.0, 0.2, 0.1, 0.2, 3.0;
  }
};

TEST(LinearModel, IsTheMatrixExponential) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Matrix3d A = random_matrix(random, 3, 3);
    const Eigen::Matrix3d W = random_covariance(random, 3);
    for (Time elapsed : {Time{1}, millisecond, 100 * millisecond, second, 5 * second}) {
      const FQ actual = over(Model(A, W), elapsed), expected = van_loan(A, W, seconds(elapsed));
      EXPECT_LT(error(actual.F, expected.F), 1e-13);
      EXPECT_LT(error(actual.Q, expected.Q), 1e-13);
      EXPECT_TRUE(exactly_symmetric(actual.Q));
    }
  }
}

TEST(LinearModel, OfASizeKnownAtRunTimeIsTheSame) {
  Random random(3);
  const Eigen::Matrix3d A = random_matrix(random, 3, 3), W = random_covariance(random, 3);
  const FQ fixed = over(Model(A, W), 2 * second), bounded = over(Bounded(A, W), 2 * second);
  EXPECT_LT(error(fixed.F, bounded.F), 1e-14);
  EXPECT_LT(error(fixed.Q, bounded.Q), 1e-14);
}

TEST(LinearModel, TwoDurationsAreOneAfterTheOther) {
  Random random(4);
  const Stiff stiff;
  for (int i = 0; i < 100; ++i) {
    const bool random_A = i % 2 == 0;
    const Eigen::Matrix3d A = random_A ? Eigen::Matrix3d(random_matrix(random, 3, 3)) : stiff.A;
    const Model model(A, stiff.W);
    const Time a = static_cast<Time>(random.log_uniform(1e3, 3e9));
    const Time b = static_cast<Time>(random.log_uniform(1e3, 3e9));
    const FQ once = over(model, a + b), twice = after(over(model, a), over(model, b));
    EXPECT_LT(error(twice.F, once.F), random_A ? 1e-13 : 1e-11);
    EXPECT_LT(error(twice.Q, once.Q), random_A ? 1e-13 : 1e-11);
  }
}

TEST(LinearModel, OfAChainOfIntegratorsIsTheChain) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero(), W = A;
  A(0, 1) = A(1, 2) = 1.0;
  W(2, 2) = 0.08 * 0.08;
  for (Time elapsed : {millisecond, second, 1000 * second}) {
    ChainTransition<3> chain;
    ASSERT_EQ(ConstantAccelerationWithPosition(0.08).transition(elapsed, chain), Status::ok);
    const FQ actual = over(Model(A, W), elapsed), expected = dense(chain, 3);
    EXPECT_LT(error(actual.F, expected.F), 1e-13);
    EXPECT_LT(covariance_error(actual.Q, expected.Q), 1e-12);
  }
}

TEST(LinearModel, WithoutDynamicsIsAWienerProcess) {
  const Eigen::Matrix3d zero = Eigen::Matrix3d::Zero(), W = Eigen::Matrix3d::Identity();
  const FQ actual = over(Model(zero, W), 7 * second);
  EXPECT_TRUE(actual.F.isIdentity(0.0));
  EXPECT_TRUE(actual.Q == 7.0 * W);
}

TEST(LinearModel, NothingMovesInNoTime) {
  const Stiff stiff;
  const FQ none = over(Model(stiff.A, stiff.W), 0);
  EXPECT_TRUE(none.F.isIdentity(0.0));
  EXPECT_TRUE(none.Q.isZero(0.0));
}

TEST(LinearModel, AStiffStableModelIsStationaryAfterAYear) {
  const Stiff stiff;
  const FQ actual = over(Model(stiff.A, stiff.W), year);
  EXPECT_LT(actual.F.cwiseAbs().maxCoeff(), 1e-300);
  EXPECT_LT(covariance_error(actual.Q, lyapunov(stiff.A, stiff.W)), 1e-10);
  EXPECT_GT(smallest_correlation_eigenvalue(actual.Q), 0.0);
}

TEST(LinearModel, AnUnstableModelOverAYearIsNumerical) {
  const Eigen::Matrix3d A = Eigen::Vector3d{0.01, -1.0, -2.0}.asDiagonal();
  Model::Transition out;
  EXPECT_EQ(Model(A, Eigen::Matrix3d::Identity()).transition(year, out), Status::numerical);
  EXPECT_EQ(Model(A, Eigen::Matrix3d::Identity()).transition(60 * second, out), Status::ok);
}

TEST(LinearModel, ParametersThatAreNotNumbersAreNumerical) {
  Model::Transition out;
  for (double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    Eigen::Matrix3d A = -Eigen::Matrix3d::Identity(), W = Eigen::Matrix3d::Identity();
    A(1, 2) = bad;
    EXPECT_EQ(Model(A, W).transition(second, out), Status::numerical);
    A(1, 2) = 0.0;
    W(0, 0) = bad;
    EXPECT_EQ(Model(A, W).transition(second, out), Status::numerical);
  }
}

/// A model of `Model`'s size with one entry of A or W changed.
template <class Model>
void expect_checked() {
  const Stiff good;
  const auto check = [&](auto change) {
    Stiff bad = good;
    change(bad);
    return Model(bad.A, bad.W).check();
  };
  EXPECT_EQ(check([](Stiff&) {}), ConfigStatus::ok);
  EXPECT_EQ(check([](Stiff& s) { s.W.setZero(); }), ConfigStatus::ok);
  EXPECT_EQ(check([](Stiff& s) { s.A(1, 2) = std::nan(""); }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Stiff& s) { s.W(1, 2) = HUGE_VAL; }), ConfigStatus::not_finite);
  EXPECT_EQ(check([](Stiff& s) { s.W(0, 1) = 0.4; }), ConfigStatus::not_semidefinite);
  EXPECT_EQ(check([](Stiff& s) { s.W(0, 0) = -2.0; }), ConfigStatus::not_semidefinite);
  EXPECT_EQ(check([](Stiff& s) { s.W(0, 1) = s.W(1, 0) = 1.5; }), ConfigStatus::not_semidefinite);
}

TEST(LinearModel, ChecksItsMatrices) {
  expect_checked<Model>();
  expect_checked<Bounded>();
  const Eigen::MatrixXd two = Eigen::MatrixXd::Identity(2, 2), tall = Eigen::MatrixXd::Ones(3, 2);
  const Eigen::MatrixXd three = Eigen::MatrixXd::Identity(3, 3);
  EXPECT_EQ(Bounded(two, two).check(), ConfigStatus::ok);
  EXPECT_EQ(Bounded(two, three).check(), ConfigStatus::wrong_size);
  EXPECT_EQ(Bounded(tall, three).check(), ConfigStatus::wrong_size);
  EXPECT_EQ(Bounded(three, tall).check(), ConfigStatus::wrong_size);
}

TEST(LinearModel, TransposedIsTheTranspose) {
  const Stiff stiff;
  Model::Transition transition;
  ASSERT_EQ(Model(stiff.A, stiff.W).transition(millisecond, transition), Status::ok);
  EXPECT_TRUE(same_bits(dense(transition, 3).F, transition.F));
  EXPECT_TRUE(same_bits(dense_transposed(transition, 3), transition.F.transpose()));
}

}  // namespace
}  // namespace surefix
