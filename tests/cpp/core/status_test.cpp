#include "surefix/core/status.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace surefix {
namespace {

TEST(Status, EveryOneHasItsOwnName) {
  std::set<std::string> names;
  for (int i = 0; i < status_count; ++i) names.insert(name(static_cast<Status>(i)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(status_count));
  EXPECT_STREQ(name(Status::ok), "ok");
  EXPECT_STREQ(name(Status::time_backwards), "time_backwards");
}

TEST(Counters, CountEveryStatusApart) {
  Counters counters;
  counters.count(Status::too_late);
  counters.count(Status::too_late);
  counters.count(Status::time_backwards);
  for (int i = 0; i < status_count; ++i) {
    const Status status = static_cast<Status>(i);
    const int expected = status == Status::too_late ? 2 : status == Status::time_backwards ? 1 : 0;
    EXPECT_EQ(counters[status], expected) << name(status);
  }
}

TEST(Counters, MoveACountToWhatBecameOfIt) {
  Counters counters;
  counters.count(Status::ok);
  counters.count(Status::ok);
  counters.move(Status::ok, Status::off_grid);
  EXPECT_EQ(counters[Status::ok], 1);
  EXPECT_EQ(counters[Status::off_grid], 1);
}

TEST(Counters, AreRestoredAsTheyWereSaved) {
  Counters counters, restored;
  counters.count(Status::repeated);
  restored.count(Status::ok);
  restored.restore(counters.all());
  EXPECT_EQ(restored.all(), counters.all());
}

}  // namespace
}  // namespace surefix
