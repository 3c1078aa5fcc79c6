// Counts calls of malloc and its relatives: this executable replaces them (allocations.cpp).
#pragma once

#include <gtest/gtest.h>

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

namespace surefix::no_heap {

extern bool counting;
extern long calls;

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

}  // namespace surefix::no_heap
