// The exact likelihood ratio of a fault for every onset, in one backward sweep.
//
// A fault d of unit amplitude moves the innovations by ρ_i = d_i − h_i b, where b is what it has
// moved the estimate by; with a = (b, s), s the profile's state, both are linear in a. From the end
//   M ← Φᵀ M Φ + cᵀ S⁻¹ c      ℓ ← Φᵀ ℓ + cᵀ S⁻¹ ν
// and a fault that begins at i with s = S₀ a changes the likelihood by
//   𝓛(z) − 𝓛(z − d a) = 2 aᵀ S₀ᵀℓ_s − aᵀ (S₀ᵀ M_ss S₀) a.
// M_bb is the Λ of every backward sweep and ℓ_b is −λ; only the blocks of s are new:
//   M_bs ← (I − kh)ᵀ M_bs + δ (m − D hᵀ) c           m = Λk, D = 1/S + kᵀm
//   M_ss ← M_ss + δ (cᵀ q + qᵀ c) + δ² D cᵀc         q = kᵀM_bs, δ the fault's weight in i
//   ℓ_s  ← ℓ_s + δ cᵀ w                              w = (Γ⁻¹γ)_i
// so that ℓ_s is Σ d_i w_i: half the first-order indicator of Parellier, Barrau & Bonnabel (18).
#pragma once

#include "surefix/core/lane.hpp"
#include "surefix/core/predict.hpp"
#include "surefix/desync/backward_sweep.hpp"
#include "surefix/drift/profile.hpp"

namespace surefix::drift {

/// What the sweep holds of a fault that begins at a measurement.
struct Information {
  Profile::Matrix gram;   ///< M_ss (p × p)
  Profile::Matrix known;  ///< the same if the state were known: Σ δ² cᵀc / r
};

/// The blocks of M that belong to the profile, and Λ.
template <class Record>
class InformationSweep {
  static constexpr int N = Record::states;
  using Belief = typename Record::Belief;

 public:
  InformationSweep(int n, int p) noexcept
      : Lambda_(Belief::Matrix::Zero(n, n)),
        m_(Belief::Vector::Zero(n)),
        at_{Profile::Matrix::Zero(p, p), Profile::Matrix::Zero(p, p)} {
    cross_.fill(m_);
  }

  template <class Measurement>
  SUREFIX_INLINE void take(const Measurement& measurement, double weight,
                           const Profile::Vector& c) noexcept {
    const auto h = measurement.h();
    const auto& k = measurement.gain;
    const int n = static_cast<int>(k.size()), p = static_cast<int>(c.size());
    const double D = desync::sweep_precision<N>(Lambda_, h, k, measurement.inverse, m_);
    std::array<double, Profile::max_size> q;
    for (int j = 0; j < p; ++j) {
      auto& column = cross(j);
      double sum = 0.0;
      loop<N>(n, [&](int i) SUREFIX_LAMBDA { sum += k(i) * column(i); });
      h.for_each([&](int i, double hi) SUREFIX_LAMBDA { column(i) -= hi * sum; });
      q[static_cast<std::size_t>(j)] = sum;
    }
    if (weight == 0.0) return;
    const double precision = 1.0 / measurement.noise;
    for (int j = 0; j < p; ++j) {
      const double d = weight * c(j);
      if (d == 0.0) continue;
      auto& column = cross(j);
      loop<N>(n, [&](int i) SUREFIX_LAMBDA { column(i) += d * m_(i); });
      h.for_each([&](int i, double hi) SUREFIX_LAMBDA { column(i) -= d * D * hi; });
      for (int i = 0; i < p; ++i) {
        const double dq = d * q[static_cast<std::size_t>(i)], e = d * (weight * c(i));
        at_.gram(i, j) += dq + e * D;
        at_.gram(j, i) += dq;
        at_.known(i, j) += e * precision;
      }
    }
  }
  /// Back over the measurement's transition, F of the state and `A` of the profile.
  template <class Measurement>
  SUREFIX_INLINE void move(const Measurement& measurement, const Profile::Matrix& A) noexcept {
    const int n = static_cast<int>(m_.size()), p = static_cast<int>(A.rows());
    propagate_transposed(Lambda_, measurement.transition);
    for (int j = 0; j < p; ++j) measurement.transition.apply_transposed(cross(j));
    const auto before = cross_;
    for (int j = 0; j < p; ++j) {
      auto& column = cross(j);
      for (int l = 0; l < p; ++l) {
        const auto& old = before[static_cast<std::size_t>(l)];
        const double a = A(l, j);
        if (l == 0) loop<N>(n, [&](int i) SUREFIX_LAMBDA { column(i) = a * old(i); });
        if (l > 0) loop<N>(n, [&](int i) SUREFIX_LAMBDA { column(i) += a * old(i); });
      }
    }
    back(at_.gram, A);
    back(at_.known, A);
  }
  [[nodiscard]] const Information& now() const noexcept { return at_; }

 private:
  [[nodiscard]] SUREFIX_INLINE typename Belief::Vector& cross(int j) noexcept {
    return cross_[static_cast<std::size_t>(j)];
  }
  /// M ← Aᵀ M A.
  static void back(Profile::Matrix& M, const Profile::Matrix& A) noexcept {
    const int p = static_cast<int>(A.rows());
    const Profile::Matrix old = M;
    for (int j = 0; j < p; ++j)
      for (int i = 0; i <= j; ++i) {
        double sum = 0.0;
        for (int l = 0; l < p; ++l)
          for (int r = 0; r < p; ++r) sum += (A(r, i) * A(l, j)) * old(r, l);
        M(i, j) = M(j, i) = sum;
      }
  }

  typename Belief::Matrix Lambda_;
  typename Belief::Vector m_;
  std::array<typename Belief::Vector, Profile::max_size> cross_;  // columns of M_bs
  Information at_;
};

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

/// Whether a fault in `direction` can begin at measurement i: it is seen there, and not yet by one
/// before it of the same time.
template <class Record>
[[nodiscard]] bool can_begin(const Record& record, const double* direction,
                             std::size_t i) noexcept {
  if (record.weight(i, direction) == 0.0) return false;
  for (; i > 0 && !(record[i].elapsed > 0.0); --i)
    if (record.weight(i - 1, direction) != 0.0) return false;
  return true;
}

/// Sweeps `parts` (`InformationSweep`, `SignalSweep`, …) together from the last measurement to the
/// first: `take(measurement, i, weight)`, then, where a fault can begin, `visit(i)`, then
/// `move(…)`. False if the profile overflows.
template <class Record, class Take, class Visit, class Move>
[[nodiscard]] SUREFIX_INLINE bool onset_sweep(const Record& record, const Profile& profile,
                                              const double* direction, Take&& take, Visit&& visit,
                                              Move&& move) noexcept {
  ProfileStep step(profile);
  for (std::size_t i = record.size(); i-- > 0;) {
    const auto measurement = record[i];
    const double weight = record.weight(i, direction);
    take(measurement, i, weight);
    if (weight != 0.0 && can_begin(record, direction, i)) visit(i);
    if (i == 0 || !(measurement.elapsed > 0.0)) continue;
    if (!step.over(measurement.elapsed)) return false;
    move(measurement, step.F());
  }
  return true;
}

}  // namespace surefix::drift
