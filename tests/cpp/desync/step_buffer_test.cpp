#include "surefix/desync/step_buffer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <tuple>

#include "printing.hpp"
#include "random.hpp"

namespace surefix::desync {
namespace {

using Key = std::tuple<Time, std::int32_t, double>;

Key key(const Measurement& m) { return {m.valid, m.sensor, m.value}; }

template <class Buffer>
std::vector<Key> keys(const Buffer& buffer) {
  std::vector<Key> out;
  for (std::size_t i = 0; i < buffer.count(); ++i) out.push_back(key(buffer[i]));
  return out;
}

/// Every arrival order of these leaves in the same order.
std::vector<Measurement> with_ties() {
  return {{10, 1.0, 0, 0}, {20, 1.0, 1, 0}, {20, 2.0, 2, 0},
          {20, 1.5, 3, 1}, {20, 1.0, 4, 2}, {30, -1.0, 5, 1}};
}

TEST(StepBuffer, SortsAnyOrderByValidityThenSensorThenValue) {
  std::vector<Measurement> arrivals = with_ties();
  std::vector<Key> sorted;
  for (const Measurement& m : arrivals) sorted.push_back(key(m));
  ASSERT_TRUE(std::is_sorted(sorted.begin(), sorted.end()));
  std::vector<std::size_t> order(arrivals.size());
  std::iota(order.begin(), order.end(), 0);
  do {
    StepBuffer<8> buffer;
    for (std::size_t i : order) ASSERT_EQ(buffer.push(arrivals[i]), Status::ok);
    ASSERT_EQ(keys(buffer), sorted);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(StepBuffer, TakesARepeatedMeasurementOnceWhereverItStands) {
  for (const Measurement& again : with_ties()) {
    StepBuffer<8> buffer;
    for (const Measurement& m : with_ties()) ASSERT_EQ(buffer.push(m), Status::ok);
    const auto before = keys(buffer);
    EXPECT_EQ(buffer.push(again), Status::repeated);
    EXPECT_EQ(keys(buffer), before);
  }
}

TEST(StepBuffer, KeepsEqualStampsWithDifferentValues) {
  StepBuffer<4> buffer;
  EXPECT_EQ(buffer.push({10, 2.0, 0, 0}), Status::ok);
  EXPECT_EQ(buffer.push({10, 1.0, 1, 0}), Status::ok);
  EXPECT_EQ(buffer.push({10, 2.0, 2, 1}), Status::ok);
  EXPECT_EQ(buffer.count(), 3u);
}

template <class Buffer>
void expect_full(Buffer buffer) {
  for (int i = 0; i < 4; ++i) ASSERT_EQ(buffer.push({10 * i, 1.0, i, 0}), Status::ok);
  const auto before = keys(buffer);
  EXPECT_EQ(buffer.push({5, 1.0, 9, 0}), Status::buffer_full);
  EXPECT_EQ(buffer.push({35, 1.0, 9, 0}), Status::buffer_full);
  EXPECT_EQ(keys(buffer), before);
  EXPECT_EQ(buffer.push({20, 1.0, 9, 0}), Status::repeated) << "a repetition needs no room";
  buffer.pop(1);
  EXPECT_EQ(buffer.push({5, 1.0, 9, 0}), Status::ok);
}

TEST(StepBuffer, StaysAsItIsWhenFull) {
  expect_full(StepBuffer<4>());
  expect_full(StepBuffer<-1>(4));
}

TEST(StepBuffer, OfNoCapacityIsAlwaysFull) {
  StepBuffer<-1> buffer(0);
  EXPECT_EQ(buffer.push({0, 1.0, 0, 0}), Status::buffer_full);
  EXPECT_EQ(buffer.ready(100), 0u);
}

TEST(StepBuffer, IsReadyUpToAndIncludingATime) {
  StepBuffer<8> buffer;
  for (const Measurement& m : with_ties()) ASSERT_EQ(buffer.push(m), Status::ok);
  EXPECT_EQ(buffer.ready(9), 0u);
  EXPECT_EQ(buffer.ready(10), 1u);
  EXPECT_EQ(buffer.ready(19), 1u);
  EXPECT_EQ(buffer.ready(20), 5u);
  EXPECT_EQ(buffer.ready(1000), 6u);
}

TEST(StepBuffer, PopLeavesTheRestInOrder) {
  StepBuffer<8> buffer;
  for (const Measurement& m : with_ties()) ASSERT_EQ(buffer.push(m), Status::ok);
  buffer.pop(4);
  ASSERT_EQ(buffer.count(), 2u);
  EXPECT_EQ(buffer[0].id, 4);
  EXPECT_EQ(buffer[1].id, 5);
  buffer.pop(2);
  EXPECT_EQ(buffer.count(), 0u);
}

TEST(StepBuffer, IsSortedAfterAThousandRandomArrivals) {
  test::Random random(21);
  StepBuffer<-1> buffer(1000);
  for (int i = 0; i < 1000; ++i)
    (void)buffer.push({random.integer(300), 1.0 * random.integer(3), i, random.integer(3)});
  const auto all = keys(buffer);
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end()));
  EXPECT_EQ(std::adjacent_find(all.begin(), all.end()), all.end());
}

}  // namespace
}  // namespace surefix::desync
