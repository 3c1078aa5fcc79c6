#include "surefix/core/any_model.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "dense.hpp"
#include "systems.hpp"

namespace surefix {
namespace {

using namespace test;

/// What `AnyModel` gives must be what the model itself gives, to the bit.
template <class Model>
void expect_same(const Model& model, Time elapsed) {
  const AnyModel any(model);
  const int n = model.state_size();
  ASSERT_EQ(any.state_size(), n);
  typename Model::Transition transition;
  AnyModel::Transition any_transition;
  ASSERT_EQ(model.transition(elapsed, transition), Status::ok);
  ASSERT_EQ(any.transition(elapsed, any_transition), Status::ok);
  const FQ expected = dense(transition, n);
  EXPECT_TRUE(same_bits(any_transition.F, expected.F));
  EXPECT_TRUE(same_bits(any_transition.Q, expected.Q));
}

TEST(AnyModel, IsTheModelThatItHolds) {
  Random random(6);
  const Eigen::MatrixXd A = random_matrix(random, 4, 4), W = random_covariance(random, 4);
  for (Time elapsed : {Time{0}, 200 * millisecond, 3 * second}) {
    expect_same(ConstantVelocity(0.1), elapsed);
    expect_same(ConstantVelocityWithPosition(0.1), elapsed);
    expect_same(ConstantAcceleration(0.1), elapsed);
    expect_same(ConstantAccelerationWithPosition(0.1), elapsed);
    expect_same(AnyModel::Linear(A, W), elapsed);
    expect_same(AnyModel::Discrete(A, W, 100 * millisecond), elapsed);
  }
}

TEST(AnyModel, PassesOnWhyATransitionDoesNotExist) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(2, 2);
  AnyModel::Transition out;
  EXPECT_EQ(AnyModel(AnyModel::Discrete(one, one, second)).transition(1, out), Status::off_grid);
  EXPECT_EQ(AnyModel(AnyModel::Linear(one, one)).transition(year, out), Status::numerical);
}

TEST(AnyModel, PassesOnWhatIsWrongWithTheModel) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(2, 2);
  EXPECT_EQ(AnyModel(ConstantVelocity(0.1)).check(), ConfigStatus::ok);
  EXPECT_EQ(AnyModel(ConstantVelocity(-0.1)).check(), ConfigStatus::negative);
  EXPECT_EQ(AnyModel(ConstantVelocityWithPosition(-0.1)).check(), ConfigStatus::negative);
  EXPECT_EQ(AnyModel(ConstantAcceleration(-0.1)).check(), ConfigStatus::negative);
  EXPECT_EQ(AnyModel(ConstantAccelerationWithPosition(-0.1)).check(), ConfigStatus::negative);
  EXPECT_EQ(AnyModel(AnyModel::Linear(one, one)).check(), ConfigStatus::ok);
  EXPECT_EQ(AnyModel(AnyModel::Linear(one, -one)).check(), ConfigStatus::not_semidefinite);
  EXPECT_EQ(AnyModel(AnyModel::Discrete(one, one, second)).check(), ConfigStatus::ok);
  EXPECT_EQ(AnyModel(AnyModel::Discrete(one, one, 0)).check(), ConfigStatus::not_positive);
}

}  // namespace
}  // namespace surefix
