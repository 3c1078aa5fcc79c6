// The counter itself: it has to count, or no test of this executable says anything.
#include "no_heap/allocations.hpp"

#include <Eigen/Core>
#include <cstdlib>
#include <new>
#include <vector>

namespace surefix::no_heap {

bool counting = false;
long calls = 0;

}  // namespace surefix::no_heap

using surefix::no_heap::calls;
using surefix::no_heap::counting;

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

namespace surefix::no_heap {
namespace {

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

}  // namespace
}  // namespace surefix::no_heap
