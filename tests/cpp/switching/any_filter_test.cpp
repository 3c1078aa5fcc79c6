#include "surefix/switching/any_filter.hpp"

#include <gtest/gtest.h>

#include "switching/switching.hpp"

namespace surefix::switching {
namespace {

FilterPlan plan() {
  FilterPlan plan;
  plan.systems = {testing::two_states()};
  plan.chain = testing::four_modes();
  plan.p = {plan.chain.transition};
  return plan;
}

ConfigStatus made(const FilterPlan& plan) {
  std::unique_ptr<AnyFilter> out;
  const ConfigStatus status = AnyFilter::make(Method::imm, plan, out);
  EXPECT_EQ(out != nullptr, status == ConfigStatus::ok);
  return status;
}

TEST(AnySwitchingFilter, RefusesAPlanWhosePartsDoNotFit) {
  EXPECT_EQ(made(plan()), ConfigStatus::ok);
  FilterPlan none = plan();
  none.systems.clear();
  EXPECT_EQ(made(none), ConfigStatus::wrong_size);
  FilterPlan small = plan();
  small.p = {Eigen::MatrixXd::Identity(2, 2)};
  EXPECT_EQ(made(small), ConfigStatus::wrong_size);
  FilterPlan three = plan();
  three.systems.assign(3, testing::two_states());
  EXPECT_EQ(made(three), ConfigStatus::wrong_size);
  FilterPlan uneven = plan();
  uneven.systems[0].H = {Eigen::MatrixXd::Ones(1, 3)};
  EXPECT_EQ(made(uneven), ConfigStatus::wrong_size);
}

TEST(AnySwitchingFilter, HasRoomFor32StatesOfAllModesTogether) {
  for (const int states : {32, 33}) {
    FilterPlan wide = plan();
    wide.systems.assign(4, testing::two_states());
    wide.map.mean.assign(static_cast<std::size_t>(states), 0.0);
    wide.map.variance.assign(static_cast<std::size_t>(states), 1.0);
    for (int i = 0; i < states; ++i) wide.map.all.push_back(i);
    wide.map.states.assign(4, {0, states - 1});
    EXPECT_EQ(made(wide), states == 32 ? ConfigStatus::ok : ConfigStatus::wrong_size);
  }
}

TEST(AnyLinearFilter, WritesWhatIsWantedAndRefusesWhatIsTooLarge) {
  AnyLinearFilter filter;
  const FilterPlan good = plan();
  ASSERT_EQ(AnyLinearFilter::make(good.systems[0], good.chain, good.p, {}, filter),
            ConfigStatus::ok);
  const std::vector<double> z{0.3, std::nan(""), 1.2};
  std::vector<double> x(6), P(12);
  ASSERT_EQ(filter.run({z.data(), nullptr, 0, 1, 3}, {x.data(), P.data(), nullptr, nullptr}).status,
            Status::ok);
  std::vector<double> alone(12);
  ASSERT_EQ(
      filter.run({z.data(), nullptr, 0, 1, 3}, {nullptr, alone.data(), nullptr, nullptr}).status,
      Status::ok);
  EXPECT_EQ(alone, P);

  LinearSystem large;
  large.A = large.Q = large.H = large.R = {Eigen::MatrixXd::Identity(33, 33)};
  large.x0 = Eigen::VectorXd::Zero(33);
  large.P0 = Eigen::MatrixXd::Identity(33, 33);
  EXPECT_EQ(AnyLinearFilter::make(large, good.chain, good.p, {}, filter), ConfigStatus::wrong_size);
  EXPECT_EQ(AnyLinearFilter::make(good.systems[0], good.chain, {}, {}, filter),
            ConfigStatus::wrong_size);
}

}  // namespace
}  // namespace surefix::switching
