#include "surefix/core/integrator_chain.hpp"

#include <gtest/gtest.h>

#include <string>

#include "bits.hpp"
#include "dense.hpp"
#include "systems.hpp"

namespace surefix {
namespace {

using namespace test;

template <class Model>
class IntegratorChainTest : public ::testing::Test {
 protected:
  static constexpr int n = Model::size;
  static constexpr double q = 0.3;

  static FQ over(Time elapsed) {
    typename Model::Transition transition;
    EXPECT_EQ(Model(q).transition(elapsed, transition), Status::ok);
    return dense(transition, n);
  }
  static FQ exponential(Time elapsed) {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n), W = A;
    for (int i = 0; i + 1 < n; ++i) A(i, i + 1) = 1.0;
    W(n - 1, n - 1) = q * q;
    return van_loan(A, W, seconds(elapsed));
  }
};

using Chains = ::testing::Types<ConstantVelocity, ConstantVelocityWithPosition,
                                ConstantAcceleration, ConstantAccelerationWithPosition>;
struct ChainName {
  template <class Model>
  static std::string GetName(int) {
    return std::to_string(Model::size) + "_reads_" + std::to_string(Model::output);
  }
};
TYPED_TEST_SUITE(IntegratorChainTest, Chains, ChainName);

TYPED_TEST(IntegratorChainTest, IsTheMatrixExponential) {
  for (Time elapsed : {Time{1}, millisecond, second, 100 * second}) {
    const FQ actual = this->over(elapsed), expected = this->exponential(elapsed);
    EXPECT_LT(error(actual.F, expected.F), 1e-15);
    EXPECT_LT(covariance_error(actual.Q, expected.Q), 1e-15);
    EXPECT_TRUE(exactly_symmetric(actual.Q));
  }
}

TYPED_TEST(IntegratorChainTest, TwoDurationsAreOneAfterTheOther) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Time a = static_cast<Time>(random.log_uniform(1e3, 1e12));
    const Time b = static_cast<Time>(random.log_uniform(1e3, 1e12));
    const FQ once = this->over(a + b), twice = after(this->over(a), this->over(b));
    EXPECT_LT(error(twice.F, once.F), 1e-14);
    EXPECT_LT(covariance_error(twice.Q, once.Q), 1e-14);
  }
}

TYPED_TEST(IntegratorChainTest, NothingMovesInNoTime) {
  const FQ none = this->over(0);
  EXPECT_TRUE(none.F.isIdentity(0.0));
  EXPECT_TRUE(none.Q.isZero(0.0));
}

TYPED_TEST(IntegratorChainTest, AYearIsTheClosedForm) {
  const FQ actual = this->over(year);
  const int size = TypeParam::size;
  const Real dt = 31'557'600.0L, q2 = Real(this->q) * this->q;
  MatrixR F = MatrixR::Zero(size, size), Q = F;
  for (int i = 0; i < size; ++i)
    for (int j = 0; j < size; ++j) {
      const int a = size - 1 - i, b = size - 1 - j;
      if (j >= i) F(i, j) = std::pow(dt, j - i) / std::tgamma(Real(j - i + 1));
      Q(i, j) = q2 * std::pow(dt, a + b + 1) /
                (std::tgamma(Real(a + 1)) * std::tgamma(Real(b + 1)) * (a + b + 1));
    }
  EXPECT_LT(covariance_error(actual.Q, Q), 1e-15);
  EXPECT_LT(error(actual.F, F), 1e-15);
}

TYPED_TEST(IntegratorChainTest, TransposedIsTheTranspose) {
  typename TypeParam::Transition transition;
  ASSERT_EQ(TypeParam(1.0).transition(3 * second, transition), Status::ok);
  EXPECT_TRUE(
      same_bits(dense_transposed(transition, this->n), dense(transition, this->n).F.transpose()));
}

TYPED_TEST(IntegratorChainTest, ChecksItsDensity) {
  const auto check = [](double density) { return TypeParam(density).check(); };
  EXPECT_EQ(check(0.0), ConfigStatus::ok);
  EXPECT_EQ(check(0.08), ConfigStatus::ok);
  EXPECT_EQ(check(-0.08), ConfigStatus::negative);
  EXPECT_EQ(check(std::nan("")), ConfigStatus::not_finite);
  EXPECT_EQ(check(std::numeric_limits<double>::infinity()), ConfigStatus::not_finite);
  EXPECT_EQ(check(1e200), ConfigStatus::not_finite) << "its square is infinite";
}

TEST(ConstantAcceleration, IsEquation33OfBilenne) {
  const double dt = 0.2, q2 = 0.08 * 0.08;
  ConstantAcceleration::Transition transition;
  ASSERT_EQ(ConstantAcceleration(0.08).transition(200 * millisecond, transition), Status::ok);
  const FQ actual = dense(transition, 2);
  const Eigen::Matrix2d F{{1.0, dt}, {0.0, 1.0}};
  const Eigen::Matrix2d Q{{dt * dt * dt / 3.0, dt * dt / 2.0}, {dt * dt / 2.0, dt}};
  EXPECT_LT(error(actual.F, F), 1e-15);
  EXPECT_LT(covariance_error(actual.Q, q2 * Q), 1e-15);
}

}  // namespace
}  // namespace surefix
