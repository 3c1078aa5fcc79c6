// A range of independent work in several threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <system_error>
#include <thread>
#include <type_traits>
#include <vector>

namespace surefix::bindings {

/// work(first, last) over [0, count) in at most `threads` parts, each a multiple of `grain` long
/// but the last; returns what they return, if anything, in order. A part for which no thread can be
/// started runs here; the first exception of a part is thrown when all have ended.
template <class Work>
auto in_parts(std::int64_t count, int threads, std::int64_t grain, Work&& work) {
  using Result = decltype(work(0, 0));
  static_assert(!std::is_same_v<Result, bool>, "of a vector<bool>, threads write the same word");
  constexpr bool returns = !std::is_void_v<Result>;
  const std::int64_t grains = (count + grain - 1) / grain;
  const std::int64_t parts = std::max<std::int64_t>(1, std::min<std::int64_t>(threads, grains));
  const std::int64_t each = (grains + parts - 1) / parts * grain;
  std::vector<std::conditional_t<returns, Result, char>> results(static_cast<std::size_t>(parts));
  std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(parts));
  const auto part = [&](std::int64_t i) noexcept {
    try {
      const std::int64_t first = std::min(i * each, count), last = std::min(first + each, count);
      if constexpr (returns) {
        results[static_cast<std::size_t>(i)] = work(first, last);
      } else {
        work(first, last);
      }
    } catch (...) {
      thrown[static_cast<std::size_t>(i)] = std::current_exception();
    }
  };
  std::vector<std::thread> others;
  others.reserve(static_cast<std::size_t>(parts));
  for (std::int64_t i = 1; i < parts; ++i) {
    try {
      others.emplace_back(part, i);
    } catch (const std::system_error&) {
      part(i);
    }
  }
  part(0);
  for (std::thread& other : others) other.join();
  for (const std::exception_ptr& exception : thrown)
    if (exception) std::rethrow_exception(exception);
  return results;
}

}  // namespace surefix::bindings
