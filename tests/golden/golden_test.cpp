// The same bits as committed. With SUREFIX_WRITE_GOLDEN set in the environment the files are
// written instead: what changes is to be seen in review.
#include <gtest/gtest.h>

#include "replay.hpp"

namespace surefix::golden {
namespace {

void expect_same(const char* name, std::string (*replay)(const std::string&)) {
  const std::string folder = SUREFIX_GOLDEN, path = folder + "/" + name + ".csv";
  const std::string now = replay(folder);
  ASSERT_GT(now.size(), 1000u);
  if (std::getenv("SUREFIX_WRITE_GOLDEN") != nullptr) {
    std::ofstream(path) << now;
    return;
  }
  std::ifstream file(path);
  std::istringstream replayed(now);
  std::string expected, line;
  for (int row = 1; std::getline(file, expected); ++row) {
    ASSERT_TRUE(std::getline(replayed, line)) << path << " has more rows than the replay: " << row;
    ASSERT_EQ(line, expected) << path << ":" << row;
  }
  EXPECT_FALSE(std::getline(replayed, line)) << path << " lacks rows: " << line;
}

TEST(Golden, SpeedMonitor) { expect_same("speed", speed); }
TEST(Golden, FaultHypotheses) { expect_same("robust", robust); }
TEST(Golden, SwitchingFilters) { expect_same("switching", switching); }
TEST(Golden, SlidingDetector) { expect_same("drift", drift); }
TEST(Golden, TrackMonitor) { expect_same("raim", raim); }

}  // namespace
}  // namespace surefix::golden
