// The forward record and the one backward sweep over it.
//
// With γ the innovation of all the recorded measurements given what was known before the first of
// them and Γ its covariance, the sweep gives (Γ⁻¹γ)_i and (Γ⁻¹)_ii for every one in O(N n²) to
// O(N n³), where a factorisation of Γ takes O(N³). It carries the adjoint λ (n) of the state and
// its covariance Λ (n × n), the Bryson–Frazier smoother's:
//   w_i = ν_i/S_i − k_iᵀλ           (Γ⁻¹γ)_i
//   D_i = 1/S_i + k_iᵀ Λ k_i        (Γ⁻¹)_ii
//   λ ← Fᵀ (λ + h_iᵀ w_i)           Λ ← Fᵀ ((I − k_i h_i)ᵀ Λ (I − k_i h_i) + h_iᵀ h_i / S_i) F
// Parellier, Barrau & Bonnabel 2023, eqs. 20-22 are the same recursion for ∂𝓛/∂z = 2 Γ⁻¹γ.
#pragma once

#include "surefix/core/predict.hpp"
#include "surefix/core/system.hpp"
#include "surefix/core/update.hpp"

namespace surefix::desync {

/// What the forward pass keeps of one measurement.
template <class System>
struct Record {
  Time valid;           ///< [ns]
  std::int64_t id;      ///< of the measurement
  std::int32_t sensor;  ///< index in the system
  double factor;        ///< of its standard deviation
  Linearisation at;     ///< where its row was linearised
  Innovation<typename System::Belief> innovation;
};

/// λ and Λ after a measurement: how the measurements that come later depend on the state.
template <class Belief>
struct Adjoint {
  typename Belief::Vector lambda;
  typename Belief::Matrix Lambda;

  [[nodiscard]] static Adjoint zero(int n) noexcept {
    return {Belief::Vector::Zero(n), Belief::Matrix::Zero(n, n)};
  }
};

/// to ← from, component by component, as for a belief.
template <class Belief>
SUREFIX_INLINE void assign(Adjoint<Belief>& to, const Adjoint<Belief>& from) noexcept {
  constexpr int N = Belief::fixed_size;
  const int n = static_cast<int>(from.lambda.size());
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    to.lambda(j) = from.lambda(j);
    loop<N>(n, [&](int i) SUREFIX_LAMBDA { to.Lambda(i, j) = from.Lambda(i, j); });
  });
}

/// (Γ⁻¹γ)_i and (Γ⁻¹)_ii of one measurement.
struct Whitened {
  double value;
  double precision;
};

/// The mean's part of a sweep over one measurement with row h, gain k and 1/S: returns
/// w = (Γ⁻¹γ)_i and takes it into λ, all of them lanes.
template <int N, class V, class Row, class Gain, class Lane>
[[nodiscard]] SUREFIX_INLINE Lane sweep_mean(V& lambda, const Row& h, const Gain& k, double inverse,
                                             const Lane& innovation) noexcept {
  const int n = static_cast<int>(k.size());
  Lane adjoint_gain = lambda(0) * k(0);
  loop<N>(n, [&](int i) SUREFIX_LAMBDA {
    if (i > 0) adjoint_gain += lambda(i) * k(i);
  });
  const Lane w = innovation * inverse - adjoint_gain;
  h.for_each([&](int i, double hi) SUREFIX_LAMBDA { lambda(i) += hi * w; });
  return w;
}

/// The covariance's part: returns D = (Γ⁻¹)_ii, leaves m = Λ k, and takes both into Λ.
template <int N, class M, class V, class Row, class Gain>
[[nodiscard]] SUREFIX_INLINE double sweep_precision(M& Lambda, const Row& h, const Gain& k,
                                                    double inverse, V& m) noexcept {
  const int n = static_cast<int>(k.size());
  loop<N>(n, [&](int i) SUREFIX_LAMBDA { m(i) = Lambda(i, 0) * k(0); });
  loop<N>(n, [&](int j) SUREFIX_LAMBDA {
    if (j > 0) loop<N>(n, [&](int i) SUREFIX_LAMBDA { m(i) += Lambda(i, j) * k(j); });
  });
  double quadratic = 0.0;
  loop<N>(n, [&](int i) SUREFIX_LAMBDA { quadratic += m(i) * k(i); });
  const double D = inverse + quadratic;

  // (I − kh)ᵀ Λ (I − kh) + hᵀh/S = Λ − hᵀmᵀ − m h + D hᵀh: rows and columns where h is not zero.
  h.for_each([&](int i, double hi) SUREFIX_LAMBDA {
    loop<N>(n, [&](int j) SUREFIX_LAMBDA { Lambda(i, j) -= hi * m(j); });
    loop<N>(n, [&](int j) SUREFIX_LAMBDA { Lambda(j, i) -= hi * m(j); });
  });
  h.for_each([&](int i, double hi) SUREFIX_LAMBDA {
    h.for_each([&](int j, double hj) SUREFIX_LAMBDA { Lambda(i, j) += D * (hi * hj); });
  });
  return D;
}

/// One measurement backward: returns its `Whitened` and takes it into the adjoint.
template <class Belief, class Row>
SUREFIX_INLINE Whitened sweep_back(Adjoint<Belief>& adjoint, const Row& h,
                                   const Innovation<Belief>& innovation) noexcept {
  constexpr int N = Belief::fixed_size;
  typename Belief::Vector m = innovation.gain;
  const double inverse = 1.0 / innovation.variance;  // a record need not hold it
  const double value = sweep_mean<N>(adjoint.lambda, h, innovation.gain, inverse, innovation.value);
  return {value, sweep_precision<N>(adjoint.Lambda, h, innovation.gain, inverse, m)};
}

/// Sweeps back over `count` records in the order of their validity; calls
/// `visit(i, record, Whitened)` from the last to the first.
template <class System, class Visit>
void backward_sweep(const System& system, const Record<System>* records, std::size_t count,
                    Visit&& visit) noexcept {
  using Belief = typename System::Belief;
  auto adjoint = Adjoint<Belief>::zero(system.state_size());
  typename System::Transition transition;
  for (std::size_t i = count; i-- > 0;) {
    const Record<System>& record = records[i];
    const Whitened w = system.with_row(record.sensor, record.at, adjoint,
                                       [&](const auto& row, auto& value) SUREFIX_LAMBDA {
                                         return sweep_back(value, row, record.innovation);
                                       });
    visit(i, record, w);
    if (i == 0 || records[i - 1].valid == record.valid) continue;
    // The forward pass made this transition, in one leg or in several; it cannot fail now.
    (void)system.transition(record.valid - records[i - 1].valid, transition);
    transition.apply_transposed(adjoint.lambda);
    propagate_transposed(adjoint.Lambda, transition);
  }
}

}  // namespace surefix::desync
