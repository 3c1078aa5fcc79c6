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

TEST(AnySwitchingFilter, RefusesAChainWhosePartsDoNotFit) {
  const auto after = [](const auto& change) {
    FilterPlan bad = plan();
    change(bad);
    AnyLinearFilter linear;
    EXPECT_EQ(AnyLinearFilter::make(bad.systems[0], bad.chain, bad.p, {}, linear),
              ConfigStatus::wrong_size);
    return made(bad);
  };
  EXPECT_EQ(after([](FilterPlan& p) { p.p.clear(); }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](FilterPlan& p) { p.p[0] = p.p[0].leftCols(3).eval(); }),
            ConfigStatus::wrong_size);
  EXPECT_EQ(after([](FilterPlan& p) { p.chain.gamma.clear(); }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](FilterPlan& p) { p.chain.branches.pop_back(); }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](FilterPlan& p) { p.chain.initial.resize(3); }), ConfigStatus::wrong_size);
}

TEST(AnySwitchingFilter, RefusesSystemsOfModesThatAreUnlikeWithoutAMap) {
  FilterPlan same = plan();
  same.systems.assign(4, testing::two_states());
  EXPECT_EQ(made(same), ConfigStatus::ok);
  FilterPlan larger = same, measured = same;
  LinearSystem& three = larger.systems[2];
  three.A = three.Q = {Eigen::MatrixXd::Identity(3, 3)};
  three.H = {Eigen::MatrixXd::Ones(1, 3)};
  three.x0 = Eigen::Vector3d::Zero();
  three.P0 = Eigen::Matrix3d::Identity();
  EXPECT_EQ(made(larger), ConfigStatus::wrong_size);
  measured.systems[3].H = measured.systems[3].R = {Eigen::MatrixXd::Identity(2, 2)};
  EXPECT_EQ(made(measured), ConfigStatus::wrong_size);
}

TEST(AnySwitchingFilter, RefusesAMapThatDoesNotKnowEveryState) {
  const auto after = [](const auto& change) {
    FilterPlan mapped = plan();
    mapped.systems.assign(4, testing::two_states());
    mapped.map = {{{0, 1}, {0, 1}, {0, 2}, {0, 2}}, {0, 1, 2}, {0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};
    change(mapped.map);
    return made(mapped);
  };
  EXPECT_EQ(after([](StateMap&) {}), ConfigStatus::ok);
  EXPECT_EQ(after([](StateMap& m) { m.states.pop_back(); }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](StateMap& m) { m.all.pop_back(); }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](StateMap& m) { m.variance.pop_back(); }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](StateMap& m) { m.states[1] = {0}; }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](StateMap& m) { m.states[1] = {0, 3}; }), ConfigStatus::wrong_size);
  EXPECT_EQ(after([](StateMap& m) { m.states[1] = {-1, 1}; }), ConfigStatus::wrong_size);
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
  for (const int columns : {1, 3})
    EXPECT_EQ(AnyLinearFilter::make(good.systems[0], good.chain, good.p,
                                    Eigen::MatrixXd::Zero(3, columns), filter),
              ConfigStatus::wrong_size);
  std::vector<double> again(6);
  ASSERT_EQ(
      filter.run({z.data(), nullptr, 0, 1, 3}, {again.data(), nullptr, nullptr, nullptr}).status,
      Status::ok);
  EXPECT_EQ(again, x);  // as it was before all that was refused
}

/// One state that two rows may read; healthy throughout.
AnyLinearFilter healthy(double A, const Eigen::MatrixXd& H, const Eigen::MatrixXd& R) {
  LinearSystem system;
  system.A = {Eigen::MatrixXd::Constant(1, 1, A)};
  system.Q = {Eigen::MatrixXd::Zero(1, 1)};
  system.H = {H};
  system.R = {R};
  system.x0 = Eigen::VectorXd::Zero(1);
  system.P0 = Eigen::MatrixXd::Identity(1, 1);
  ModeChain chain;
  EXPECT_TRUE(ModeChain::make({{1.0, 1.0}}, Eigen::MatrixXd::Ones(1, 1), {}, chain));
  AnyLinearFilter filter;
  EXPECT_EQ(AnyLinearFilter::make(system, chain, {chain.transition}, {}, filter), ConfigStatus::ok);
  return filter;
}

void expect_stops(const BatchStatus& status, Status why, std::int64_t run, int step) {
  EXPECT_EQ(status.status, why);
  EXPECT_EQ(status.run, run);
  EXPECT_EQ(status.step, step);
}

TEST(AnyLinearFilter, SaysWhereAMeasurementIsInfiniteOrTheEstimateOverflows) {
  const Eigen::MatrixXd tenth = Eigen::MatrixXd::Constant(1, 1, 0.1);
  const AnyLinearFilter filter = healthy(1.0, tenth, 1e-4 * tenth);
  std::vector<double> x(6);
  const BatchOutput out{x.data(), nullptr, nullptr, nullptr};
  const std::vector<double> infinite{0.1, 0.2, 0.3, 0.1, -HUGE_VAL, 0.3};
  expect_stops(filter.run({infinite.data(), nullptr, 0, 2, 3}, out), Status::not_finite, 1, 1);
  const std::vector<double> absurd{0.1, 0.2, 0.3, 1.7e308, 0.2, 0.3};  // ten times that is too much
  expect_stops(filter.run({absurd.data(), nullptr, 0, 2, 3}, out), Status::numerical, 1, 0);
}

TEST(AnyLinearFilter, SaysWhereAGainDoesNotExist) {
  // The gain is of two rows that read the same. Where nothing is measured for two steps, the
  // error's variance is 1e20, beside which the noise is lost.
  const AnyLinearFilter filter =
      healthy(1e5, Eigen::MatrixXd::Ones(2, 1), Eigen::MatrixXd::Identity(2, 2));
  const double nan = std::nan("");
  const std::vector<double> z{0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.1, 0.1, nan, nan, 0.3, 0.3};
  std::vector<double> x(6);
  const BatchOutput out{x.data(), nullptr, nullptr, nullptr};
  expect_stops(filter.run({z.data(), nullptr, 0, 2, 3}, out), Status::numerical, 1, 2);
  EXPECT_NEAR(x[2], 0.3, 1e-5);  // of the series before it

  const AnyLinearFilter unstable =
      healthy(1e200, Eigen::MatrixXd::Ones(1, 1), Eigen::MatrixXd::Identity(1, 1));
  expect_stops(unstable.run({z.data(), nullptr, 0, 1, 3}, out), Status::numerical, 0, 1);
}

}  // namespace
}  // namespace surefix::switching
