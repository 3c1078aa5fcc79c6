// No step function touches the heap: this executable replaces malloc and counts.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "raim/epochs.hpp"
#include "robust/faults.hpp"
#include "surefix/desync/any_filter.hpp"
#include "surefix/drift/sliding_detector.hpp"
#include "switching/switching.hpp"
#include "systems.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SUREFIX_COUNTS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SUREFIX_COUNTS 0
#endif
#endif
#if !defined(SUREFIX_COUNTS)
#if defined(__GLIBC__)
#define SUREFIX_COUNTS 1
#else
#define SUREFIX_COUNTS 0
#endif
#endif

namespace {
bool counting = false;
long calls = 0;
}  // namespace

#if SUREFIX_COUNTS
// Every allocation of the process, operator new included, ends in one of these.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) noexcept {
  calls += counting;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  calls += counting;
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) noexcept {
  calls += counting;
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  calls += counting;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  return memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  *out = memalign(alignment, size);
  return *out == nullptr ? 12 : 0;  // ENOMEM
}
}
#endif

namespace surefix::desync {
namespace {

using namespace test;

class NoHeap : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!SUREFIX_COUNTS) GTEST_SKIP() << "malloc cannot be replaced here";
  }
};

/// Calls of malloc and its relatives while `body` runs.
template <class Body>
long allocations(Body&& body) {
  calls = 0;
  counting = true;
  body();
  counting = false;
  return calls;
}

/// Whatever can happen in a hundred steps: estimates, late and refused measurements.
template <class Estimate = StepError, class F, class System>
bool hundred_steps(F& filter, const System& system, Random& random) {
  bool ok = true;
  Time time = 0;
  for (int step = 0; step < 100; ++step) {
    for (int i = 0; i < 20; ++i) {
      const Time stamp = time + 200 * millisecond + random.integer(200) * millisecond;
      const Status status = filter.push(stamp, random.integer(system.sensor_count()),
                                        20.0 + random.normal(), 20 * step + i);
      ok = ok && (status == Status::ok || status == Status::repeated);
    }
    ok = ok && filter.push(time - second, 0, 20.0, 0) == Status::too_late;
    ok = ok && filter.push(time + 1, system.sensor_count(), 20.0, 0) == Status::unknown_sensor;
    ok = ok && filter.push(time + 1, 0, std::nan(""), 0) == Status::not_finite;
    time += 400 * millisecond;
    Estimate estimate;
    ok = ok && filter.estimate(time, estimate) == Status::ok;
    ok = ok && filter.estimate(time - second, estimate) == Status::time_backwards;
  }
  return ok;
}

template <class System>
void expect_no_heap(const System& system) {
  Filter<System, 64> filter(system, broad(system), 0);
  Random random(101);
  bool ok = false;
  double sum = 0.0;
  EXPECT_EQ(allocations([&] {
              ok = hundred_steps(filter, system, random);
              filter.noise([&](std::size_t, const NoiseEstimate& e) { sum += e.value; });
            }),
            0);
  EXPECT_TRUE(ok);
  EXPECT_GT(filter.used(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

void* volatile sink;  // so that no compiler leaves an allocation out

TEST_F(NoHeap, TheCounterCounts) {
  EXPECT_EQ(allocations([] { std::free((sink = std::malloc(100))); }), 1);
  EXPECT_EQ(allocations([] { std::free((sink = std::calloc(10, 10))); }), 1);
  EXPECT_EQ(allocations([] { std::free((sink = std::realloc(nullptr, 100))); }), 1);
  EXPECT_EQ(allocations([] { std::free((sink = std::aligned_alloc(64, 128))); }), 1);
  EXPECT_EQ(allocations([] { delete[] static_cast<char*>(sink = new char[100]); }), 1);
  EXPECT_EQ(allocations([] { sink = Eigen::VectorXd(100).data(); }), 1);
  EXPECT_EQ(allocations([] { sink = std::vector<int>(100).data(); }), 1);
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
    EXPECT_EQ(allocations([&] { ok = hundred_steps(*filter, system, random); }), 0);
    EXPECT_TRUE(ok);
  }
}

TEST_F(NoHeap, InStepsOfTheSlidingDetector) {
  const SpeedSystem system = speed_system();
  desync::Filter<SpeedSystem, 64> filter(system, broad(system), 0);
  drift::SlidingDetector<SpeedSystem, 60> detector(system);
  drift::Profile::Matrix A(2, 2), onset(2, 1);
  A << 0.0, 1.0, 0.0, 0.0;
  onset << 0.0, 1.0;
  drift::Profile ramp;
  ASSERT_EQ(drift::Profile::make(A, Eigen::Vector2d(1.0, 0.0), onset, ramp), ConfigStatus::ok);
  A << 0.0, 2.0, -2.0, 0.0;
  drift::Profile sine;
  ASSERT_EQ(drift::Profile::make(A, Eigen::Vector2d(1.0, 0.0),
                                 drift::Profile::Matrix::Identity(2, 2), sine),
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
                ok = ok && (k < 10 || finding != drift::Finding::undetectable);
              }
            }),
            0);
  EXPECT_TRUE(ok);
}

TEST_F(NoHeap, InStepsOfTheRobustFilter) {
  using namespace robust;
  const auto carries = {Carry::Kind::merge, Carry::Kind::cut, Carry::Kind::one_gaussian};
  for (const Carry::Kind carry : carries) {
    const SpeedSystem system = speed_system();
    robust::Filter<robust::test::SpeedFaults, 64> filter(robust::test::speed_setup(carry, 60),
                                                         broad(system), 0);
    Random random(103);
    bool ok = false;
    EXPECT_EQ(allocations([&] { ok = hundred_steps<RobustEstimate>(filter, system, random); }), 0);
    EXPECT_TRUE(ok);
  }
}

TEST_F(NoHeap, InStepsOfTheSwitchingFilters) {
  using namespace switching;
  const switching::testing::Prepared prepared;
  switching::Filter<Method::imm, switching::testing::Two> imm;
  switching::Filter<Method::one_step, switching::testing::Two> one_step;
  const auto& initial = prepared.system.initial();
  ASSERT_EQ(imm.make(switching::testing::four_modes(), initial), ConfigStatus::ok);
  ASSERT_EQ(one_step.make(switching::testing::four_modes(), initial), ConfigStatus::ok);
  bool ok = true;
  EXPECT_EQ(allocations([&] {
              for (int k = 0; k < 300; ++k) {  // with gaps and gross outliers
                Measured<switching::testing::Two> z;
                z(0) = switching::testing::measurement(2, k);
                ok &= imm.step(prepared.transition(), prepared.observation(), z) == Status::ok;
                ok &= one_step.step(prepared.transition(), prepared.observation(), z) == Status::ok;
              }
            }),
            0);
  EXPECT_TRUE(ok);
}

TEST_F(NoHeap, InEpochsOfTheTrackMonitor) {
  using namespace raim;
  const Track track = raim::testing::arc();
  MonitorSettings settings;
  settings.max_excluded = 3;
  const TrackRaim monitor(track, settings);
  Random random(104);
  auto satellites = raim::testing::epoch(track, 20.0, 14, 2, random);
  satellites[3].pseudorange += 300.0;
  satellites[5].pseudorange -= 200.0;
  Verdict verdict;
  EXPECT_EQ(allocations([&] { verdict = monitor.judge(satellites.data(), 14, {}); }), 0);
  EXPECT_EQ(verdict.declared, Declared::excluded);
}

}  // namespace
}  // namespace surefix::desync
