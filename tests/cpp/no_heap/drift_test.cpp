#include "no_heap/allocations.hpp"
#include "surefix/drift/any_sliding.hpp"
#include "systems.hpp"

namespace surefix::no_heap {
namespace {

using namespace test;
using namespace drift;
using desync::StepError;

TEST_F(NoHeap, InStepsOfTheSlidingDetector) {
  const SpeedSystem system = speed_system();
  desync::Filter<SpeedSystem, 64> filter(system, broad(system), 0);
  SlidingDetector<SpeedSystem, 60> detector(system);
  Profile::Matrix A(2, 2), onset(2, 1);
  A << 0.0, 1.0, 0.0, 0.0;
  onset << 0.0, 1.0;
  Profile ramp;
  ASSERT_EQ(Profile::make(A, Eigen::Vector2d(1.0, 0.0), onset, ramp), ConfigStatus::ok);
  A << 0.0, 2.0, -2.0, 0.0;
  Profile sine;
  ASSERT_EQ(Profile::make(A, Eigen::Vector2d(1.0, 0.0), Profile::Matrix::Identity(2, 2), sine),
            ConfigStatus::ok);
  ASSERT_EQ(detector.add(ramp, {1.0}, 1e-3), ConfigStatus::ok);
  ASSERT_EQ(detector.add(sine, {0.0, 1.0}, 1e-3), ConfigStatus::ok);
  Random random(7);
  bool ok = true;
  EXPECT_EQ(allocations([&] {
              for (int k = 1; k <= 100; ++k) {
                const Time now = second + k * 100 * millisecond;
                for (int s = 0; s < 2; ++s)
                  ok = ok && filter.push(now, s, 20.0 + random.normal(), k) == Status::ok;
                StepError error;
                ok = ok && filter.estimate(now, error) == Status::ok;
                detector.take(filter);
                const auto finding = detector.look(k % 2).finding;
                ok = ok && (k < 10 || finding != Finding::undetectable);
              }
            }),
            0);
  EXPECT_TRUE(ok);
}

TEST_F(NoHeap, InStepsOfADetectorChosenAtRunTimeOnceItIsMade) {
  const auto initial =
      any_belief(Eigen::Vector2d(20.0, 0.0), 100.0 * Eigen::MatrixXd::Identity(2, 2));
  const auto detector = AnySliding::make(any_speed_system(), initial, std::nullopt, 64, 60);
  ASSERT_NE(detector, nullptr);
  Profile ramp;
  ASSERT_EQ(Profile::make(Eigen::Matrix2d{{0.0, 1.0}, {0.0, 0.0}}, Eigen::Vector2d(1.0, 0.0),
                          Eigen::Vector2d(0.0, 1.0), ramp),
            ConfigStatus::ok);
  ASSERT_EQ(detector->add(ramp, {1.0, 0.0, 0.0}, 1e-3), ConfigStatus::ok);
  Random random(8);
  bool ok = true;
  EXPECT_EQ(allocations([&] {
              for (int k = 1; k <= 100; ++k) {
                const Time now = second + k * 100 * millisecond;
                for (int s = 0; s < 2; ++s)
                  ok = ok && detector->push(now, s, 20.0 + random.normal(), k) == Status::ok;
                StepError error;
                ok = ok && detector->estimate(now, error) == Status::ok;
                const auto finding = detector->look(0).finding;  // anew from k = 70 on
                ok = ok && (k % 70 < 10 || finding != Finding::undetectable);
                ok = ok && detector->belief().x.allFinite();
                if (k == 70) detector->clear();
                if (k == 70) ok = ok && detector->size() == 0;
                if (k == 71) ok = ok && detector->size() > 0;
              }
            }),
            0);
  EXPECT_TRUE(ok);
}

}  // namespace
}  // namespace surefix::no_heap
