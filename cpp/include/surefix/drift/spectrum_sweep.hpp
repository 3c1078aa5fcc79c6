// The exact likelihood ratio of a sinusoid of unknown amplitude and phase through all measurements,
// for many frequencies: d_i = a cos ωt_i + b sin ωt_i.
//
// The innovations' answers to cos and sin give numerator and Gram matrix at once, for irregular
// times as for regular ones. Eight frequencies go side by side.
#pragma once

#include "surefix/drift/response.hpp"

namespace surefix::drift {

inline constexpr int frequencies_at_once = 8;
using Frequencies = Pack<frequencies_at_once>;

/// cos ωt and sin ωt, turned by ωΔt from measurement to measurement.
class Rotation {
 public:
  explicit Rotation(const Frequencies& omega) noexcept : omega_(omega) {}

  SUREFIX_INLINE void by(double elapsed) noexcept {
    if (elapsed != elapsed_) {
      elapsed_ = elapsed;
      for (int l = 0; l < frequencies_at_once; ++l) {
        turn_cos_(l) = std::cos(omega_(l) * elapsed);
        turn_sin_(l) = std::sin(omega_(l) * elapsed);
      }
    }
    const Frequencies c = cos;
    cos = c * turn_cos_ - sin * turn_sin_;
    sin = sin * turn_cos_ + c * turn_sin_;
  }

  Frequencies cos = Frequencies::Ones();
  Frequencies sin = Frequencies::Zero();

 private:
  Frequencies omega_;
  double elapsed_ = 0.0;
  Frequencies turn_cos_ = Frequencies::Ones();
  Frequencies turn_sin_ = Frequencies::Zero();
};

/// Calls `visit(i, ρ_cos, ρ_sin, d_cos, d_sin)` for every measurement; ωt is zero at the first.
template <class Record, class Visit>
void spectrum_sweep(const Record& record, const double* direction, const Frequencies& omega,
                    Visit&& visit) noexcept {
  Response<Record, Frequencies> cos(record.state_size()), sin(record.state_size());
  Rotation rotation(omega);
  for (std::size_t i = 0; i < record.size(); ++i) {
    const auto measurement = record[i];
    if (i > 0 && measurement.elapsed > 0.0) {
      rotation.by(measurement.elapsed);
      cos.move(measurement);
      sin.move(measurement);
    }
    const double weight = record.weight(i, direction);
    const Frequencies d_cos = weight * rotation.cos, d_sin = weight * rotation.sin;
    visit(i, measurement, cos.take(measurement, d_cos), sin.take(measurement, d_sin), d_cos, d_sin);
  }
}

}  // namespace surefix::drift
