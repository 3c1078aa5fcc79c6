// The filter that knows every mode: the Kalman filter with γ_k H and δ_k R, the bound that the
// others are measured against (section VI). With γ = δ = 1 throughout it is the Kalman filter.
#pragma once

#include <cmath>

#include "surefix/core/observation.hpp"
#include "surefix/core/predict.hpp"
#include "surefix/core/scaled_product.hpp"
#include "surefix/core/status.hpp"
#include "surefix/core/update.hpp"
#include "surefix/switching/state.hpp"

namespace surefix::switching {

/// Estimate and likelihood of one series, or of as many as the lane holds.
template <class S, class Lane>
struct GenieState {
  Belief<S, Lane> merged;
  ScaledProduct<Lane> variances;  // Π S of all innovations
  Lane squares = Lanes<Lane>::all(0.0);
  Lane count = Lanes<Lane>::all(0.0);  // scalar measurements

  /// log p of all measurements.
  [[nodiscard]] double log_likelihood(int lane) const noexcept {
    constexpr double log_2pi = 1.83787706640934548356;
    return -0.5 * (Lanes<Lane>::get(squares, lane) + variances.log(lane) +
                   Lanes<Lane>::get(count, lane) * log_2pi);
  }
};

/// γ and δ of the series' modes now; the same for all if `same`.
template <class Lane>
struct KnownMode {
  Lane gamma, delta;
  bool same;
};

/// Lane `target` of one state ← lane `lane` of another.
template <class S, class To, class From>
void copy_lane(GenieState<S, To>& to, int target, const GenieState<S, From>& from,
               int lane) noexcept {
  copy_lane(to.merged, target, from.merged, lane);
  to.variances.copy_lane(target, from.variances, lane);
  Lanes<To>::set(to.squares, target, Lanes<From>::get(from.squares, lane));
  Lanes<To>::set(to.count, target, Lanes<From>::get(from.count, lane));
}

namespace detail {

/// Reads one scalar. False if the innovation's variance is not positive.
template <class S, class Row, class Factor, class Lane>
[[nodiscard]] SUREFIX_INLINE bool read_row(const Row& row, const Factor& r, const Lane& z,
                                           GenieState<S, Lane>& state) noexcept {
  const Lane innovation = z - row.dot(state.merged.x);
  Innovation<Belief<S, Lane>> brought;
  if (!update(state.merged, row, r, innovation, brought)) return false;
  state.squares += innovation * (innovation * brought.inverse);
  state.variances.multiply(brought.variance);
  return true;
}

/// Reads z (whitened) with rows γ h; `gamma` and `delta` a number or a lane.
template <class S, class O, class Lane, class Factor>
[[nodiscard]] SUREFIX_INLINE bool read_known(const Observation<O>& observation,
                                             const Measured<O, Lane>& z, const Factor& gamma,
                                             const Factor& delta,
                                             GenieState<S, Lane>& state) noexcept {
  using Row = Eigen::Matrix<Factor, S::n, 1, 0, S::max_n, 1>;
  bool good = true;
  loop<O::m>(observation.size(), [&](int i) SUREFIX_LAMBDA {
    if (!good) return;
    const auto h = observation.row(i, 1.0);
    const int n = static_cast<int>(h.size());
    Row scaled;
    if constexpr (S::n == Eigen::Dynamic) scaled.resize(n);
    scaled(0) = gamma * h(0);
    loop<S::n>(n, [&](int j) SUREFIX_LAMBDA {
      if (j > 0) scaled(j) = gamma * h(j);
    });
    const Factor r = observation.variance(i) * delta;
    if constexpr (S::n == 1 && std::is_same_v<Factor, double>) {
      if (scaled(0) == 1.0) {  // the same bits without the multiplications
        good = read_row<S>(ComponentRow<0>{}, r, z(i), state);
        return;
      }
    }
    good = read_row<S>(DenseRow<Row>{scaled}, r, z(i), state);
  });
  state.count += static_cast<double>(observation.size());
  return good;
}

/// Where γ = 0 nothing is learnt, not even by rounding.
template <class S, class Lane>
SUREFIX_INLINE void keep_unread(const Lane& gamma, const Belief<S, Lane>& before,
                                Belief<S, Lane>& after) noexcept {
  if constexpr (S::n == 1) {
    using L = Lanes<Lane>;
    for (int l = 0; l < L::count; ++l)
      if (L::get(gamma, l) == 0.0) L::set(after.P(0, 0), l, L::get(before.P(0, 0), l));
  }
}

}  // namespace detail

/// A step of series whose measurements are complete; `transition` is null in the first one. False
/// if an innovation's variance is not positive.
template <class S, class O, class Lane>
[[nodiscard]] SUREFIX_INLINE bool take_genie_step(const Transition<S>* transition,
                                                  const Observation<O>& observation,
                                                  const KnownMode<Lane>& mode, Measured<O, Lane> z,
                                                  GenieState<S, Lane>& state) noexcept {
  if (transition != nullptr) predict(state.merged, *transition);
  observation.whiten(z);
  if (mode.same) {
    const double gamma = Lanes<Lane>::get(mode.gamma, 0), delta = Lanes<Lane>::get(mode.delta, 0);
    if (gamma != 0.0) return detail::read_known<S>(observation, z, gamma, delta, state);
  }
  const Belief<S, Lane> before = state.merged;
  const bool good = detail::read_known<S>(observation, z, mode.gamma, mode.delta, state);
  detail::keep_unread<S>(mode.gamma, before, state.merged);
  return good;
}

/// The steps of one series and of packs; series that lack a component take theirs alone.
template <class S>
class Genie {
 public:
  /// NaN in z are missing components.
  [[nodiscard]] Status alone(const Transition<S>* transition, const Observation<S>& observation,
                             const KnownMode<double>& mode, const Measured<S>& z,
                             GenieState<S, double>& state) noexcept {
    bool complete = true, good = false;
    loop<S::m>(static_cast<int>(z.size()), [&](int i) SUREFIX_LAMBDA { complete &= finite(z(i)); });
    if (!complete && is_infinite(z)) return Status::not_finite;
    if (complete) {
      good = take_genie_step(transition, observation, mode, z, state);
    } else if (reduced_.reduce(observation, z, present_)) {
      good = take_genie_step(transition, reduced_, mode, present_, state);
    }
    return good && is_finite(state.merged) ? Status::ok : Status::numerical;
  }

  /// A step of K series; `failed` is the lane in which it fails. The caller looks whether what
  /// comes out is finite.
  template <int K>
  [[nodiscard]] SUREFIX_INLINE Status together(const Transition<S>* transition,
                                               const Observation<S>& observation,
                                               const KnownMode<Pack<K>>& mode,
                                               const Measured<S, Pack<K>>& z,
                                               GenieState<S, Pack<K>>& state,
                                               int& failed) noexcept {
    bool complete = true;
    loop<S::m>(static_cast<int>(z.size()), [&](int i) SUREFIX_LAMBDA { complete &= finite(z(i)); });
    if (!complete) return around_missing(transition, observation, mode, z, state, failed);
    if (take_genie_step(transition, observation, mode, z, state)) return Status::ok;
    return first_failure(observation, mode, z, state, failed);
  }

 private:
  template <int K>
  [[nodiscard]] Status around_missing(const Transition<S>* transition,
                                      const Observation<S>& observation,
                                      const KnownMode<Pack<K>>& mode, const Measured<S, Pack<K>>& z,
                                      GenieState<S, Pack<K>>& state, int& failed) noexcept {
    Measured<S, Pack<K>> filled = z;
    std::uint32_t missing = 0;
    for (int i = 0; i < static_cast<int>(z.size()); ++i)
      for (int l = 0; l < K; ++l)
        if (!finite(z(i)(l))) {
          missing |= std::uint32_t{1} << l;
          filled(i)(l) = 0.0;
        }
    const GenieState<S, Pack<K>> before = state;
    if (!take_genie_step(transition, observation, mode, filled, state))
      return first_failure(observation, mode, filled, state, failed);
    Measured<S> own(z.size());
    for (int l = 0; l < K; ++l) {
      if ((missing >> l & 1U) == 0) continue;
      for (int i = 0; i < static_cast<int>(z.size()); ++i) own(i) = z(i)(l);
      copy_lane(single_, 0, before, l);
      const KnownMode<double> known{mode.gamma(l), mode.delta(l), true};
      const Status status = alone(transition, observation, known, own, single_);
      if (status != Status::ok) {
        failed = l;
        return status;
      }
      copy_lane(state, l, single_, 0);
    }
    return Status::ok;
  }

  /// The lane in which a pack that has been predicted cannot be read.
  template <int K>
  [[nodiscard]] Status first_failure(const Observation<S>& observation,
                                     const KnownMode<Pack<K>>& mode, const Measured<S, Pack<K>>& z,
                                     const GenieState<S, Pack<K>>& state, int& failed) noexcept {
    Measured<S> own = Measured<S>::Zero(z.size());
    for (failed = 0; failed < K - 1; ++failed) {
      for (int i = 0; i < static_cast<int>(z.size()); ++i) own(i) = z(i)(failed);
      copy_lane(single_, 0, state, failed);
      const KnownMode<double> known{mode.gamma(failed), mode.delta(failed), true};
      if (alone(nullptr, observation, known, own, single_) != Status::ok) break;
    }
    return Status::numerical;
  }

  Observation<Reduced<S>> reduced_;
  Measured<Reduced<S>> present_;
  GenieState<S, double> single_;
};

}  // namespace surefix::switching
