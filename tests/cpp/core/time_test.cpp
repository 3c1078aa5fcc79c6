#include "surefix/core/time.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "random.hpp"

namespace surefix {
namespace {

Time converted(double value) {
  Time out = -1;
  EXPECT_TRUE(to_time(value, out)) << value;
  return out;
}

TEST(Time, IsTheNearestNanosecond) {
  EXPECT_EQ(converted(0.0), 0);
  EXPECT_EQ(converted(1.5), 1'500'000'000);
  EXPECT_EQ(converted(0.1), 100'000'000);
  EXPECT_EQ(converted(-1e-9), -1);
  EXPECT_EQ(converted(0.6e-9), 1);
  EXPECT_EQ(converted(0.4e-9), 0);
}

TEST(Time, OfUnixKeepsTheNanosecondsThatADoubleHolds) {
  EXPECT_EQ(converted(1.7e9 + 0.25), 1'700'000'000'250'000'000);
  EXPECT_EQ(converted(-1.7e9 - 0.125), -1'700'000'000'125'000'000);
  EXPECT_EQ(converted(2999999999.5), 2'999'999'999'500'000'000);
}

TEST(Time, TiesGoToTheEvenNanosecond) {
  EXPECT_EQ(converted(0x1p-10), 976'562);        // 976562.5 ns
  EXPECT_EQ(converted(3 * 0x1p-10), 2'929'688);  // 2929687.5 ns
  EXPECT_EQ(converted(-0x1p-10), -976'562);
}

TEST(Time, RefusesWhatIsNotFiniteOrOutOfRange) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double beyond = std::nextafter(max_seconds, infinity);
  for (double value : {std::nan(""), infinity, -infinity, beyond, -beyond, 1e300}) {
    Time out = 42;
    EXPECT_FALSE(to_time(value, out)) << value;
    EXPECT_EQ(out, 42);
  }
}

TEST(Time, TheWholeRangeFitsWithItsDifferencesAndLatencies) {
  EXPECT_EQ(converted(max_seconds), 3'000'000'000'000'000'000);
  EXPECT_EQ(converted(-max_seconds), -3'000'000'000'000'000'000);
  constexpr double longest = 2.0 * max_seconds + 2.0 * max_latency;
  EXPECT_LT(longest * 1e9, static_cast<double>(std::numeric_limits<Time>::max()));
}

TEST(Time, SecondsAndBackIsTheSameNanosecondForTwoWeeks) {
  test::Random random(1);
  for (int i = 0; i < 10000; ++i) {
    const Time time = static_cast<Time>(random.uniform(-1e15, 1e15));
    EXPECT_EQ(converted(seconds(time)), time);
  }
}

}  // namespace
}  // namespace surefix
