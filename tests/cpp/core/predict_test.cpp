#include "surefix/core/predict.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "dense.hpp"
#include "surefix/core/integrator_chain.hpp"
#include "surefix/core/transition.hpp"

namespace surefix {
namespace {

using namespace test;

template <int N, class Transition>
void expect_textbook(const Transition& transition, Random& random) {
  Gaussian<N> belief{random_matrix(random, N, 1), random_covariance(random, N)};
  Kalman expected(belief);
  predict(belief, transition);
  expected.predict(dense(transition, N));
  EXPECT_LT(error(belief.x, expected.x), 1e-14);
  EXPECT_LT(error(belief.P, expected.P), 1e-14);
  EXPECT_TRUE(exactly_symmetric(belief.P));
}

TEST(Predict, IsFPFtPlusQ) {
  Random random(11);
  for (int i = 0; i < 100; ++i) {
    const double dt = random.log_uniform(1e-3, 1e3);
    expect_textbook<1>(ChainTransition<1>(dt, 0.1), random);
    expect_textbook<2>(ChainTransition<2>(dt, 0.1), random);
    expect_textbook<3>(ChainTransition<3>(dt, 0.1), random);
    const Eigen::MatrixXd F = random_matrix(random, 6, 6), Q = random_covariance(random, 6);
    expect_textbook<6>(DenseTransition<6>{{F}, Q}, random);
  }
}

TEST(Predict, TransposedIsFtLambdaF) {
  Random random(12);
  const Eigen::MatrixXd F = random_matrix(random, 6, 6), Q = random_covariance(random, 6);
  Eigen::Matrix<double, 6, 6> Lambda = random_covariance(random, 6);
  const Eigen::MatrixXd expected = F.transpose() * Lambda * F;
  propagate_transposed(Lambda, DenseTransition<6>{{F}, Q});
  EXPECT_LT(error(Lambda, expected), 1e-14);
  EXPECT_TRUE(exactly_symmetric(Lambda));
}

TEST(Gaussian, IsFiniteOnlyIfEveryMeanAndVarianceIs) {
  const Gaussian<2> good{Eigen::Vector2d{1e308, -1e308}, Eigen::Matrix2d::Identity()};
  EXPECT_TRUE(is_finite(good));
  for (double bad : {std::nan(""), std::numeric_limits<double>::infinity(),
                     -std::numeric_limits<double>::infinity()})
    for (int i : {0, 1}) {
      Gaussian<2> mean = good, variance = good;
      mean.x(i) = bad;
      variance.P(i, i) = bad;
      EXPECT_FALSE(is_finite(mean));
      EXPECT_FALSE(is_finite(variance));
    }
}

}  // namespace
}  // namespace surefix
