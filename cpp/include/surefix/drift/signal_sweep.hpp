// What the data say of a fault that could begin at each measurement: ℓ in `onset_sweep.hpp`.
#pragma once

#include "surefix/core/lane.hpp"
#include "surefix/desync/backward_sweep.hpp"
#include "surefix/drift/profile.hpp"

namespace surefix::drift {

/// λ and ℓ_s, of one run or of as many as the lane holds.
template <class Record, class Lane>
class SignalSweep {
  static constexpr int N = Record::states;

 public:
  using Amplitudes = Eigen::Matrix<Lane, Eigen::Dynamic, 1, 0, Profile::max_size, 1>;

  SignalSweep(int n, int p) noexcept : lambda_(n), signal_(p) {
    for (int i = 0; i < n; ++i) lambda_(i) = Lanes<Lane>::all(0.0);
    for (int j = 0; j < p; ++j) signal_(j) = Lanes<Lane>::all(0.0);
  }

  template <class Measurement>
  SUREFIX_INLINE void take(const Measurement& measurement, double weight, const Profile::Vector& c,
                           const Lane& innovation) noexcept {
    const auto h = measurement.h();
    const Lane w =
        desync::sweep_mean<N>(lambda_, h, measurement.gain, measurement.inverse, innovation);
    if (weight == 0.0) return;
    for (int j = 0; j < static_cast<int>(c.size()); ++j) signal_(j) += (weight * c(j)) * w;
  }
  template <class Measurement>
  SUREFIX_INLINE void move(const Measurement& measurement, const Profile::Matrix& A) noexcept {
    measurement.transition.apply_transposed(lambda_);
    const Amplitudes before = signal_;
    for (int j = 0; j < static_cast<int>(signal_.size()); ++j) {
      signal_(j) = A(0, j) * before(0);
      for (int i = 1; i < static_cast<int>(signal_.size()); ++i) signal_(j) += A(i, j) * before(i);
    }
  }
  /// S₀ᵀℓ_s.
  [[nodiscard]] Amplitudes numerator(const Profile::Matrix& onset) const noexcept {
    Amplitudes out(onset.cols());
    for (int a = 0; a < static_cast<int>(onset.cols()); ++a) {
      out(a) = onset(0, a) * signal_(0);
      for (int j = 1; j < static_cast<int>(signal_.size()); ++j) out(a) += onset(j, a) * signal_(j);
    }
    return out;
  }

 private:
  typename Gaussian<N, Lane, Record::max_states>::Vector lambda_;
  Amplitudes signal_;
};

}  // namespace surefix::drift
