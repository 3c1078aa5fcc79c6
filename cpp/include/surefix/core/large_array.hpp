// Memory for numbers of a size that is known when it is made, not set to zero. Where the operating
// system has large pages it is asked for them: touched for the first time in pages of 4 KiB, memory
// costs more than what a recursion does with it.
#pragma once

#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace surefix {

/// `size` numbers; throws std::bad_alloc where there is no room, or ends the program where there
/// are no exceptions.
template <class T>
class LargeArray {
  static_assert(std::is_arithmetic_v<T>);

 public:
  LargeArray() = default;
  explicit LargeArray(std::size_t size) : size_(size), data_(allocate(size)) {}

  [[nodiscard]] T* data() noexcept { return data_.get(); }
  [[nodiscard]] const T* data() const noexcept { return data_.get(); }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] T& operator[](std::size_t i) noexcept { return data_[i]; }
  [[nodiscard]] const T& operator[](std::size_t i) const noexcept { return data_[i]; }

 private:
  struct Free {
    void operator()(T* data) const noexcept { std::free(data); }
  };
  static constexpr std::size_t large_page = std::size_t{2} << 20;

  [[nodiscard]] static T* allocate(std::size_t size) {
    std::size_t bytes = size * sizeof(T);
    const bool large = bytes >= 2 * large_page;
    const std::size_t step = large ? large_page : 64;
    bytes = (bytes / step + 1) * step;  // aligned_alloc wants a multiple
    void* data = std::aligned_alloc(step, bytes);
#if defined(__cpp_exceptions)
    if (data == nullptr) throw std::bad_alloc();
#else
    if (data == nullptr) std::abort();
#endif
#if defined(__linux__)
    if (large) (void)madvise(data, bytes, MADV_HUGEPAGE);  // advice: it may well say no
#endif
    return static_cast<T*>(data);
  }

  std::size_t size_ = 0;
  std::unique_ptr<T[], Free> data_;
};

}  // namespace surefix
