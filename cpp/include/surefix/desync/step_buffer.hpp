// The step buffer: measurements come in any order and leave in the order of their validity.
#pragma once

#include <array>
#include <vector>

#include "surefix/core/status.hpp"
#include "surefix/desync/measurement.hpp"

namespace surefix::desync {

/// An array of `Capacity` items; for Capacity −1 a vector whose size is chosen once.
template <class T, int Capacity>
struct FixedOrReserved {
  using type = std::array<T, static_cast<std::size_t>(Capacity)>;
};
template <class T>
struct FixedOrReserved<T, -1> {
  using type = std::vector<T>;
};

/// Room for `Capacity` measurements; −1 for a capacity chosen at construction.
template <int Capacity>
class StepBuffer {
 public:
  StepBuffer() = default;
  explicit StepBuffer(std::size_t capacity) : items_(capacity) {}

  /// Sorts a measurement into place: O(how far it is out of order). `buffer_full` and `repeated`
  /// leave the buffer as it was.
  [[nodiscard]] Status push(const Measurement& m) noexcept {
    std::size_t place = count_;
    while (place > 0 && before(m, items_[place - 1])) --place;
    if (place > 0 && repeats(items_[place - 1], m)) return Status::repeated;
    if (count_ == items_.size()) return Status::buffer_full;
    for (std::size_t i = count_; i > place; --i) items_[i] = items_[i - 1];
    items_[place] = m;
    ++count_;
    return Status::ok;
  }

  /// Number of measurements valid at or before `time`.
  [[nodiscard]] std::size_t ready(Time time) const noexcept {
    std::size_t n = 0;
    while (n < count_ && items_[n].valid <= time) ++n;
    return n;
  }

  /// Takes the first `n` out.
  void pop(std::size_t n) noexcept {
    for (std::size_t i = n; i < count_; ++i) items_[i - n] = items_[i];
    count_ -= n;
  }

  [[nodiscard]] const Measurement& operator[](std::size_t i) const noexcept { return items_[i]; }
  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return items_.size(); }
  void clear() noexcept { count_ = 0; }

 private:
  typename FixedOrReserved<Measurement, Capacity>::type items_{};
  std::size_t count_ = 0;
};

}  // namespace surefix::desync
