// What a backward sweep knows of a fault that could begin at each measurement, whatever the data
// are: the blocks of M in `onset_sweep.hpp`.
#pragma once

#include <array>

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

}  // namespace surefix::drift
