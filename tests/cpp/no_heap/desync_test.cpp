#include "no_heap/allocations.hpp"
#include "no_heap/hundred_steps.hpp"
#include "surefix/desync/any_filter.hpp"

namespace surefix::no_heap {
namespace {

using namespace desync;

template <class System>
void expect_no_heap(const System& system) {
  Filter<System, 64> filter(system, broad(system), 0);
  Random random(101);
  bool ok = false;
  double sum = 0.0;
  EXPECT_EQ(allocations([&] {
              ok = hundred_steps<StepError>(filter, system, random);
              filter.noise([&](std::size_t, const NoiseEstimate& e) { sum += e.value; });
            }),
            0);
  EXPECT_TRUE(ok);
  EXPECT_GT(filter.used(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST_F(NoHeap, InStepsOfTheSpeedSystem) { expect_no_heap(speed_system()); }

TEST_F(NoHeap, InStepsOfALinearModel) {
  Eigen::Matrix3d A, W = Eigen::Matrix3d::Zero();
  A << 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -0.1;
  W(2, 2) = 0.01;
  using Linear = System<LinearModel<3>, 1, 1, 2>;
  Linear system{LinearModel<3>(A, W)};
  const Eigen::Vector3d position{1.0, 0.0, 0.0}, speed{0.0, 1.0, 0.0};
  ASSERT_EQ(system.add(sensor<Linear>(speed, 0.5, 0, {0.1, 60.0})), ConfigStatus::ok);
  ASSERT_EQ(system.add(sensor<Linear>(position, 2.0, 10 * millisecond)), ConfigStatus::ok);
  expect_no_heap(system);
}

TEST_F(NoHeap, InStepsOfADiscreteModel) {
  using Discrete = System<DiscreteModel<2>, 0, 0, 1>;
  const Eigen::Matrix2d F{{1.0, 0.001}, {0.0, 1.0}}, Q{{1e-9, 0.0}, {0.0, 1e-6}};
  Discrete system{DiscreteModel<2>(F, Q, millisecond)};
  const Eigen::Vector2d speed{1.0, 0.0};
  ASSERT_EQ(system.add(sensor<Discrete>(speed, 0.5)), ConfigStatus::ok);
  expect_no_heap(system);
}

TEST_F(NoHeap, InStepsOfASystemChosenAtRunTime) {
  expect_no_heap(train_system());
  const Eigen::MatrixXd A = -Eigen::MatrixXd::Identity(8, 8), W = Eigen::MatrixXd::Identity(8, 8);
  AnySystem largest{AnyModel(AnyModel::Linear(A, W))};
  const Eigen::VectorXd h = Eigen::VectorXd::Ones(8);
  for (int s = 0; s < 16; ++s)
    ASSERT_EQ(largest.add(sensor<AnySystem>(h, 0.5, 0, {0.1, 60.0}, {0.1})), ConfigStatus::ok);
  ASSERT_EQ(largest.state_size(), 40);
  expect_no_heap(largest);
}

TEST_F(NoHeap, InStepsOfAnyFilterOnceItIsMade) {
  for (const AnySystem& system : {any_speed_system(), train_system()}) {
    const int n = system.model_size();
    const auto initial =
        any_belief(Eigen::VectorXd::Constant(n, 20.0), 100.0 * Eigen::MatrixXd::Identity(n, n));
    const auto filter = AnyFilter::make(system, initial, 0, 64);
    Random random(102);
    bool ok = false;
    EXPECT_EQ(allocations([&] { ok = hundred_steps<StepError>(*filter, system, random); }), 0);
    EXPECT_TRUE(ok);
  }
}

}  // namespace
}  // namespace surefix::no_heap
