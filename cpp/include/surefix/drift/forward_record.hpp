// What one forward pass of a filter leaves: for every scalar measurement its gain, row and 1/S, and
// the transition that led to it, wherever they came from. The backward sweeps and the responses to
// a fault read nothing else.
#pragma once

#include <vector>

#include "surefix/core/large_array.hpp"
#include "surefix/drift/passed.hpp"

namespace surefix::drift {

/// The record of `size()` scalar measurements of a state of N components, or of at most MaxN.
/// Correlated noise is whitened: z' = L⁻¹z, and `mixing` holds the rows of L⁻¹.
template <int N, int MaxN = N>
class ForwardRecord {
 public:
  static constexpr int states = N;
  static constexpr int max_states = MaxN;
  using Belief = Gaussian<N, double, MaxN>;
  using Measurement = Passed<N, MaxN>;

  /// Room for `capacity` measurements of n states.
  ForwardRecord(int n, int channels, std::size_t capacity)
      : n_(n),
        channels_(channels),
        stride_(static_cast<std::size_t>(Measurement::numbers(n))),
        numbers_(capacity * stride_),
        channel_(capacity),
        id_(capacity) {}

  /// Appends a measurement, for which there is room: `Passed::write`; `id`: the caller's.
  template <class Row, class Matrix>
  void add(const Innovation<Belief>& innovation, const Row& h, double noise, const Matrix& F,
           double elapsed, std::int32_t channel, std::int64_t id) {
    Measurement::write(numbers_.data() + count_ * stride_, innovation, h, noise, F, elapsed);
    channel_[count_] = channel;
    id_[count_++] = id;
  }
  /// How much of each channel the last measurement has; without it, all of its own.
  void mix(const double* row) { mixing_.insert(mixing_.end(), row, row + channels_); }

  [[nodiscard]] SUREFIX_INLINE Measurement operator[](std::size_t i) const noexcept {
    return Measurement::view(numbers_.data() + i * stride_, n_, channel_[i]);
  }
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] int state_size() const noexcept { return n_; }
  [[nodiscard]] int channels() const noexcept { return channels_; }
  [[nodiscard]] std::int64_t id(std::size_t i) const noexcept { return id_[i]; }
  [[nodiscard]] bool mixed() const noexcept { return !mixing_.empty(); }

  /// How much measurement i has of a fault that is `direction` (one weight for each channel).
  [[nodiscard]] SUREFIX_INLINE double weight(std::size_t i,
                                             const double* direction) const noexcept {
    if (mixing_.empty()) return direction[channel_[i]];
    const double* row = mixing_.data() + i * static_cast<std::size_t>(channels_);
    double sum = 0.0;
    for (int c = 0; c < channels_; ++c) sum += row[c] * direction[c];
    return sum;
  }

  /// Measurement i of the values `z` of all channels.
  [[nodiscard]] SUREFIX_INLINE double whitened(std::size_t i, const double* z) const noexcept {
    if (mixing_.empty()) return z[channel_[i]];
    const double* row = mixing_.data() + i * static_cast<std::size_t>(channels_);
    double sum = 0.0;
    for (int c = 0; c < channels_; ++c)
      if (row[c] != 0.0) sum += row[c] * z[c];  // those that are missing are NaN
    return sum;
  }

 private:
  int n_, channels_;
  std::size_t stride_;
  std::size_t count_ = 0;
  LargeArray<double> numbers_;  // `Passed` of each
  LargeArray<std::int32_t> channel_;
  LargeArray<std::int64_t> id_;
  std::vector<double> mixing_;
};

}  // namespace surefix::drift
