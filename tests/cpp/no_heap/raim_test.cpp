#include "no_heap/allocations.hpp"
#include "raim/epochs.hpp"
#include "surefix/raim/follower.hpp"
#include "surefix/raim/linear_test.hpp"

namespace surefix::no_heap {
namespace {

using namespace raim;
using surefix::test::Random;

TEST_F(NoHeap, InEpochsOfTheTrackMonitor) {
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

TEST_F(NoHeap, InEpochsThatAFollowerJoins) {
  const Track track = raim::testing::arc();
  MonitorSettings settings;
  settings.max_excluded = 2;
  const TrackRaim monitor(track, settings);
  Random random(105);
  std::vector<std::vector<Satellite>> epochs;
  for (int k = 0; k < 10; ++k)
    epochs.push_back(raim::testing::epoch(track, -50.0 + 10.0 * k, 12, 2, random));
  epochs[3][4].pseudorange += 300.0;
  epochs[6].resize(3);  // too few
  epochs[8][0].sigma = std::nan("");
  Follower follower(monitor, 20.0, std::nan(""));
  int used = 0;
  EXPECT_EQ(allocations([&] {
              for (int k = 0; k < 10; ++k) {
                const auto& now = epochs[static_cast<std::size_t>(k)];
                const double time = k == 5 ? std::nan("") : 1.0 * k;
                const Verdict verdict =
                    follower.judge(time, now.data(), static_cast<int>(now.size()));
                used += verdict.declared == Declared::ok || verdict.declared == Declared::excluded;
              }
            }),
            0);
  EXPECT_GE(used, 8);
}

TEST_F(NoHeap, InTheLinearTest) {
  const Eigen::MatrixXd H = Eigen::MatrixXd::Ones(6, 1), L = Eigen::MatrixXd::Identity(6, 6);
  LinearTest test;
  ASSERT_EQ(LinearTest::make(H, Eigen::MatrixXd(6, 0), L, test), ConfigStatus::ok);
  const double y[6] = {1.0, 1.0, 1.0, 1.0, 1.0, 7.0};
  double z[5], statistic = 0.0;
  EXPECT_EQ(allocations([&] {
              statistic = test.statistic(y);
              test.parity(y, z);
            }),
            0);
  EXPECT_NEAR(statistic, 30.0, 1e-12);  // Σ (y − 2)²
}

}  // namespace
}  // namespace surefix::no_heap
