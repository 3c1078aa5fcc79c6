// How the innovations answer to a fault: ρ_i = d_i − h_i b, b ← b + k_i ρ_i, b ← F b.
#pragma once

#include <cmath>

#include "surefix/core/lane.hpp"
#include "surefix/drift/profile.hpp"

namespace surefix::drift {

/// What a fault has moved the estimate by; a lane for each of several faults.
template <class Record, class Lane>
class Response {
 public:
  explicit Response(int n) noexcept : b_(n) {
    for (int i = 0; i < n; ++i) b_(i) = Lanes<Lane>::all(0.0);
  }
  /// The innovation's answer ρ to the fault's value `d` in this measurement.
  template <class Measurement>
  SUREFIX_INLINE Lane take(const Measurement& measurement, const Lane& d) noexcept {
    constexpr int N = Record::states;
    const int n = static_cast<int>(measurement.gain.size());
    Lane rho = d;
    loop<N>(n, [&](int i) SUREFIX_LAMBDA { rho -= measurement.row(i) * b_(i); });
    loop<N>(n, [&](int i) SUREFIX_LAMBDA { b_(i) += measurement.gain(i) * rho; });
    return rho;
  }
  template <class Measurement>
  SUREFIX_INLINE void move(const Measurement& measurement) noexcept {
    measurement.transition.apply(b_);
  }

 private:
  typename Gaussian<Record::states, Lane, Record::max_states>::Vector b_;
};

/// ρ of a fault that begins at measurement `first`, one row of `out` (q, size) for each amplitude.
/// False if the profile overflows.
template <class Record>
[[nodiscard]] bool onset_response(const Record& record, const Profile& profile,
                                  const double* direction, std::size_t first,
                                  double* out) noexcept {
  const std::size_t count = record.size();
  const int q = profile.amplitudes();
  ProfileStep step(profile);
  for (int a = 0; a < q; ++a) {
    Response<Record, double> response(record.state_size());
    Profile::Vector s = profile.onset().col(a);
    double* rho = out + static_cast<std::size_t>(a) * count;
    for (std::size_t i = 0; i < first; ++i) rho[i] = 0.0;
    for (std::size_t i = first; i < count; ++i) {
      const auto measurement = record[i];
      if (i > first && measurement.elapsed > 0.0) {
        if (!step.over(measurement.elapsed)) return false;
        s = Profile::Vector(step.F() * s);
        response.move(measurement);
      }
      const double weight = record.weight(i, direction);
      rho[i] = response.take(measurement, weight == 0.0 ? 0.0 : weight * profile.output().dot(s));
    }
  }
  return true;
}

}  // namespace surefix::drift
