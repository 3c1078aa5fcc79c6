// A log in the order of validity, whatever the order of its rows.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "surefix/core/status.hpp"
#include "surefix/desync/measurement.hpp"

namespace surefix::desync {

/// A log in the order of its rows: `count` stamps [ns], sensors (index, −1 if unknown), values, and
/// factors of the sensors' standard deviations, null if all are 1.
struct LogView {
  const Time* stamp;
  const std::int32_t* sensor;
  const double* value;
  std::size_t count;
  const double* factor = nullptr;
};

/// Stamp of a row whose time was NaN, infinite or out of range.
inline constexpr Time no_time = std::numeric_limits<Time>::min();

/// The usable rows of a log, sorted by validity, repeated messages taken out. Where the rows are in
/// order already nothing is copied. The log's arrays must outlive it.
class SortedLog {
 public:
  SortedLog() = default;

  /// Writes the status of every row: ok, or why it is not usable. `largest`: magnitude of a value
  /// beyond which it counts as not finite.
  template <class System>
  SortedLog(const System& system, const LogView& log, Status* status,
            double largest = std::numeric_limits<double>::max())
      : log_(log), largest_(largest), latency_(static_cast<std::size_t>(system.sensor_count())) {
    for (std::size_t s = 0; s < latency_.size(); ++s)
      latency_[s] = system.sensor(static_cast<int>(s)).latency;
    size_ = log.count;
    if (is_plain()) {
      std::fill_n(status, log.count, Status::ok);
      return;
    }
    for (std::size_t i = 0; i < log.count; ++i) status[i] = usable(i);
    sort(status);
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] Measurement operator[](std::size_t i) const noexcept {
    return row(order_.empty() ? i : order_[i]);
  }
  /// When measurement i was logged: its validity and the latency.
  [[nodiscard]] Time stamp(std::size_t i) const noexcept {
    return log_.stamp[order_.empty() ? i : order_[i]];
  }
  /// How many different validity times there are from `start` on.
  [[nodiscard]] std::size_t distinct_times(Time start) const noexcept {
    std::size_t first = 0;
    while (first < size_ && (*this)[first].valid < start) ++first;
    if (order_.empty()) return size_ - first;  // all different
    std::size_t n = 0;
    for (std::size_t i = first; i < size_; ++i)
      if (i == first || (*this)[i].valid != (*this)[i - 1].valid) ++n;
    return n;
  }

 private:
  /// Whether every row is usable and later than the one before it. What is wrong sets the sign bit
  /// of `wrong`: without comparisons the compiler makes vectors of these loops, which the filter
  /// would otherwise wait for.
  [[nodiscard]] bool is_plain() const noexcept {
    using Bits = std::uint64_t;
    constexpr Bits last_time = Bits{max_time}, sign = Bits{1} << 63;
    Bits largest;  // the bits of doubles are in the order of their magnitudes, Inf and NaN last
    std::memcpy(&largest, &largest_, sizeof largest);
    const auto last_sensor = static_cast<std::uint32_t>(latency_.size()) - 1;
    Bits wrong = 0;
    std::uint32_t unknown = 0;
    for (std::size_t i = 0; i < log_.count; ++i) {
      Bits value;
      std::memcpy(&value, &log_.value[i], sizeof value);
      wrong |= largest - (value & ~sign);
      const auto stamp = static_cast<Bits>(log_.stamp[i]);
      wrong |= (last_time + stamp) | (last_time - stamp);
      const auto sensor = static_cast<std::uint32_t>(log_.sensor[i]);
      unknown |= sensor | (last_sensor - sensor);
    }
    if ((wrong & sign) != 0 || unknown >> 31 != 0) return false;
    for (std::size_t i = 0; log_.factor != nullptr && i < log_.count; ++i)
      if (!good(log_.factor[i])) return false;
    for (std::size_t i = 1; i < log_.count; ++i)
      wrong |= static_cast<Bits>(valid(i) - valid(i - 1) - 1);
    return (wrong & sign) == 0;
  }
  [[nodiscard]] Status usable(std::size_t i) const noexcept {
    const std::int32_t s = log_.sensor[i];
    if (s < 0 || static_cast<std::size_t>(s) >= latency_.size()) return Status::unknown_sensor;
    const bool finite = std::abs(log_.value[i]) <= largest_ && in_range(log_.stamp[i]);
    return finite && good(factor(i)) ? Status::ok : Status::not_finite;
  }
  [[nodiscard]] Measurement row(std::size_t i) const noexcept {
    const std::int32_t s = log_.sensor[i];
    return {valid(i), log_.value[i], static_cast<std::int64_t>(i), s, factor(i)};
  }
  [[nodiscard]] Time valid(std::size_t i) const noexcept {
    return log_.stamp[i] - latency_[static_cast<std::size_t>(log_.sensor[i])];
  }
  [[nodiscard]] double factor(std::size_t i) const noexcept {
    return log_.factor == nullptr ? 1.0 : log_.factor[i];
  }
  [[nodiscard]] static bool good(double factor) noexcept {
    return smallest_factor <= factor && factor <= largest_factor;
  }
  void sort(Status* status) {
    for (std::size_t i = 0; i < log_.count; ++i)
      if (status[i] == Status::ok) order_.push_back(i);
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::size_t a, std::size_t b) { return before(row(a), row(b)); });
    const auto last = std::unique(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      const bool again = repeats(row(a), row(b));
      if (again) status[b] = Status::repeated;
      return again;
    });
    order_.erase(last, order_.end());
    size_ = order_.size();
  }

  LogView log_{};
  double largest_ = 0.0;
  std::vector<Time> latency_;
  std::vector<std::size_t> order_;  // rows in order; empty: all rows as they are
  std::size_t size_ = 0;
};

}  // namespace surefix::desync
