// The record of the last measurements: a forward record in a ring of fixed size, no heap in a step.
// What the detectors find in it is what they find in a `ForwardRecord` of the same measurements
// whose filter begins with the belief before the first of them: to the bit where every estimate is
// at the validity of a measurement, elsewhere to the rounding of a prediction in two legs.
#pragma once

#include "surefix/desync/step_buffer.hpp"
#include "surefix/drift/passed.hpp"

namespace surefix::drift {

/// Room for `Capacity` measurements, or −1 for one that is chosen at construction. N, MaxN: states.
template <int N, int MaxN, int Capacity>
class SlidingRecord {
 public:
  static constexpr int states = N;
  static constexpr int max_states = MaxN;
  using Belief = Gaussian<N, double, MaxN>;
  using Measurement = Passed<N, MaxN>;

  /// For n states; `capacity` as Capacity says, or chosen.
  explicit SlidingRecord(int n, std::size_t capacity = Capacity > 0 ? Capacity : 1)
      : n_(n), capacity_(capacity), stride_(static_cast<std::size_t>(Measurement::numbers(n))) {
    if constexpr (Capacity == -1) {
      numbers_.resize(capacity * stride_);
      own_.resize(capacity);
    }
  }

  /// Appends a measurement (`Passed::write`); the oldest leaves where there is no room.
  template <class Row, class Matrix>
  void add(const Innovation<Belief>& innovation, const Row& h, double noise, const Matrix& F,
           double elapsed, std::int32_t channel, Time valid) noexcept {
    if (count_ == capacity_) {
      first_ = (first_ + 1) % capacity_;
      --count_;
    }
    const std::size_t at = slot(count_++);
    Measurement::write(numbers_.data() + at * stride_, innovation, h, noise, F, elapsed);
    own_[at] = {innovation.value, valid, channel};
  }
  void clear() noexcept { count_ = 0; }

  [[nodiscard]] SUREFIX_INLINE Measurement operator[](std::size_t i) const noexcept {
    const std::size_t at = slot(i);
    return Measurement::view(numbers_.data() + at * stride_, n_, own_[at].channel);
  }
  [[nodiscard]] double innovation(std::size_t i) const noexcept { return own_[slot(i)].innovation; }
  /// When measurement i was valid [ns].
  [[nodiscard]] Time valid(std::size_t i) const noexcept { return own_[slot(i)].valid; }
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  [[nodiscard]] int state_size() const noexcept { return n_; }
  [[nodiscard]] SUREFIX_INLINE double weight(std::size_t i,
                                             const double* direction) const noexcept {
    return direction[own_[slot(i)].channel];
  }

 private:
  struct Own {
    double innovation;
    Time valid;
    std::int32_t channel;
  };
  static constexpr int numbers = Measurement::numbers(MaxN);
  template <class T, int Count>
  using Storage = typename desync::FixedOrReserved<T, Capacity == -1 ? -1 : Count>::type;

  [[nodiscard]] std::size_t slot(std::size_t i) const noexcept { return (first_ + i) % capacity_; }

  int n_;
  std::size_t capacity_, stride_;
  std::size_t first_ = 0, count_ = 0;
  Storage<double, Capacity * numbers> numbers_{};
  Storage<Own, Capacity> own_{};
};

}  // namespace surefix::drift
