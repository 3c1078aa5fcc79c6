// What a switching filter knows after a step: a plain value.
#pragma once

#include "surefix/core/scaled_product.hpp"
#include "surefix/switching/mode_law.hpp"

namespace surefix::switching {

/// The likelihood of all measurements so far: log p = Σ log_sum + log Π product − ½ count log 2π.
template <class Lane>
struct Evidence {
  ScaledProduct<Lane> product;
  Lane log_sum = Lanes<Lane>::all(0.0);
  Lane count = Lanes<Lane>::all(0.0);  // scalar measurements

  /// What was known before, and the densities factor · e^exponent of `measured` scalars.
  SUREFIX_INLINE void follow(const Evidence& before, const Lane& factor, const Lane& exponent,
                             int measured) noexcept {
    product = before.product;
    product.multiply(factor);
    log_sum = before.log_sum + exponent;
    count = before.count + static_cast<double>(measured);
  }
  [[nodiscard]] double log_likelihood(int lane) const noexcept {
    constexpr double half_log_2pi = 0.91893853320467274178;
    return Lanes<Lane>::get(log_sum, lane) + product.log(lane) -
           Lanes<Lane>::get(count, lane) * half_log_2pi;
  }
};

/// State of one series, or of as many as the lane holds.
template <class S, class Lane>
struct State {
  Belief<S, Lane> merged;              // the estimate
  Bank<Belief<S, Lane>, S::M> bank{};  // of each mode; the IMM's own, in other filters scratch
  ModeLaw<S, Lane> law;
  Evidence<Lane> evidence;

  /// Room for M modes.
  void make(int M) {
    resize(bank, M);
    resize(law.mode, M);
    resize(law.log_mode, M);
  }
};

/// Lane `to` of one belief ← lane `lane` of another.
template <class To, class From>
void copy_lane(To& to, int target, const From& from, int lane) noexcept {
  using A = Lanes<typename To::Scalar>;
  using B = Lanes<typename From::Scalar>;
  const int n = from.size();
  if constexpr (To::fixed_size == Eigen::Dynamic) {
    if (to.size() != n) {
      to.x.resize(n);
      to.P.resize(n, n);
    }
  }
  for (int j = 0; j < n; ++j) {
    A::set(to.x(j), target, B::get(from.x(j), lane));
    for (int i = 0; i < n; ++i) A::set(to.P(i, j), target, B::get(from.P(i, j), lane));
  }
}

/// Lane `target` of one state ← lane `lane` of another.
template <class S, class To, class From>
void copy_lane(State<S, To>& to, int target, const State<S, From>& from, int lane) noexcept {
  using A = Lanes<To>;
  using B = Lanes<From>;
  copy_lane(to.merged, target, from.merged, lane);
  for (std::size_t j = 0; j < from.law.mode.size(); ++j) {
    copy_lane(to.bank[j], target, from.bank[j], lane);
    A::set(to.law.mode[j], target, B::get(from.law.mode[j], lane));
    A::set(to.law.log_mode[j], target, B::get(from.law.log_mode[j], lane));
  }
  A::set(to.law.deep, target, B::get(from.law.deep, lane));
  to.evidence.product.copy_lane(target, from.evidence.product, lane);
  A::set(to.evidence.log_sum, target, B::get(from.evidence.log_sum, lane));
  A::set(to.evidence.count, target, B::get(from.evidence.count, lane));
}

}  // namespace surefix::switching
