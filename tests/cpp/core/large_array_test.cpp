#include "surefix/core/large_array.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace surefix {
namespace {

// These sanitizers end the program where malloc would answer null.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool sanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif
#else
constexpr bool sanitized = false;
#endif

TEST(LargeArray, HasRoomForItsNumbersInWholeCacheLines) {
  for (const std::size_t size : {std::size_t{1}, std::size_t{1000}, std::size_t{1} << 20}) {
    LargeArray<double> array(size);
    ASSERT_EQ(array.size(), size);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(array.data()) % 64, 0u);
    array[0] = 1.0;
    array[size - 1] = 2.0;
    EXPECT_EQ(array[0], size == 1 ? 2.0 : 1.0);
    EXPECT_EQ(array.data()[size - 1], 2.0);
  }
  EXPECT_EQ(LargeArray<double>().size(), 0u);
}

TEST(LargeArray, ThrowsWhereThereIsNoRoom) {
  if (sanitized) GTEST_SKIP() << "with this sanitizer";
  const std::size_t beyond = std::size_t{1} << 58;  // 2^61 bytes
  EXPECT_THROW(LargeArray<double>{beyond}, std::bad_alloc);
}

}  // namespace
}  // namespace surefix
