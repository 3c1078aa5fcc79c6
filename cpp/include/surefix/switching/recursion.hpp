// Steps of one series, and of a pack of series side by side.
//
// A pack takes the plain step. A series in it that is not plain (a component missing, a probability
// near the end of the numbers) takes its step alone, from the state before, so that no series
// feels the others and all have the bits that they would have alone.
#pragma once

#include <cmath>

#include "surefix/switching/step_in_logs.hpp"

namespace surefix::switching {

/// One filter's steps; `Method` says which. The room that they need is taken when it is made.
template <Method method, class S>
class Recursion {
 public:
  Recursion() = default;
  /// For the modes of a chain and `systems` systems.
  Recursion(const ModeTable<S>& modes, int systems) { make(modes, systems); }
  void make(const ModeTable<S>& modes, int systems) {
    modes_ = modes;
    room_.make(modes.size());
    reduced_.resize(at(systems));
    reduced_pointers_.resize(at(systems));
    from_.make(modes.size());
    to_.make(modes.size());
  }

  /// There are transitions in which the mode may be entered.
  void allow(int mode) noexcept { modes_.allow(mode); }

  /// A step of one series; NaN in z are missing components. `to` is not to be read if it fails:
  /// not_finite, if z is infinite; numerical, if the prediction overflows or no mode has a density
  /// at z.
  [[nodiscard]] Status alone(const Step<S>& step, const Observation<S>* const* observation,
                             const Measured<S>& z, const State<S, double>& from,
                             State<S, double>& to) noexcept {
    bool complete = true;
    loop<S::m>(static_cast<int>(z.size()), [&](int i) SUREFIX_LAMBDA { complete &= finite(z(i)); });
    if (complete) return one(step, observation, z, from, to);
    if (is_infinite(z)) return Status::not_finite;
    for (std::size_t s = 0; s < reduced_.size(); ++s) {
      if (!reduced_[s].reduce(*observation[s], z, present_)) return Status::numerical;
      reduced_pointers_[s] = &reduced_[s];
    }
    return one(step, reduced_pointers_.data(), present_, from, to);
  }

  /// A step of K series; `failed` is the lane in which it fails.
  template <int K>
  [[nodiscard]] SUREFIX_INLINE Status together(const Step<S>& step,
                                               const Observation<S>* const* observation,
                                               const Measured<S, Pack<K>>& z,
                                               const State<S, Pack<K>>& from, State<S, Pack<K>>& to,
                                               Workspace<S, Pack<K>>& room, int& failed) noexcept {
    std::uint32_t again = 0;
    bool complete = true;
    loop<S::m>(static_cast<int>(z.size()), [&](int i) SUREFIX_LAMBDA { complete &= finite(z(i)); });
    if (complete) {
      again = take_step<method>(step, observation, modes_, z, from, to, room);
    } else {
      again = around_missing(step, observation, z, from, to, room);
    }
    if (from.law.deep.sum() != 0.0)
      for (int l = 0; l < K; ++l)
        if (from.law.deep(l) != 0.0) again |= std::uint32_t{1} << l;
    return again == 0 ? Status::ok : one_by_one(again, step, observation, z, from, to, failed);
  }

 private:
  /// The plain step of the lanes whose measurements are complete; returns the others, too.
  template <int K>
  [[nodiscard]] std::uint32_t around_missing(const Step<S>& step,
                                             const Observation<S>* const* observation,
                                             const Measured<S, Pack<K>>& z,
                                             const State<S, Pack<K>>& from, State<S, Pack<K>>& to,
                                             Workspace<S, Pack<K>>& room) noexcept {
    std::uint32_t missing = 0;
    Measured<S, Pack<K>> filled = z;
    for (int i = 0; i < static_cast<int>(z.size()); ++i)
      for (int l = 0; l < K; ++l)
        if (!finite(z(i)(l))) {
          missing |= std::uint32_t{1} << l;
          filled(i)(l) = 0.0;
        }
    return missing | take_step<method>(step, observation, modes_, filled, from, to, room);
  }

  /// Those lanes alone.
  template <int K>
  [[nodiscard]] Status one_by_one(std::uint32_t lanes, const Step<S>& step,
                                  const Observation<S>* const* observation,
                                  const Measured<S, Pack<K>>& z, const State<S, Pack<K>>& from,
                                  State<S, Pack<K>>& to, int& failed) noexcept {
    Measured<S> own(z.size());
    for (int l = 0; l < K; ++l) {
      if ((lanes >> l & 1U) == 0) continue;
      for (int i = 0; i < static_cast<int>(z.size()); ++i) own(i) = z(i)(l);
      copy_lane(from_, 0, from, l);
      copy_lane(to_, 0, to, l);  // the sizes
      const Status status = alone(step, observation, own, from_, to_);
      if (status != Status::ok) {
        failed = l;
        return status;
      }
      copy_lane(to, l, to_, 0);
    }
    return Status::ok;
  }

  template <class O>
  [[nodiscard]] SUREFIX_INLINE Status one(const Step<S>& step,
                                          const Observation<O>* const* observation,
                                          const Measured<O>& z, const State<S, double>& from,
                                          State<S, double>& to) noexcept {
    if (from.law.deep == 0.0 &&
        take_step<method>(step, observation, modes_, z, from, to, room_) == 0)
      return Status::ok;
    const bool done = take_step_in_logs<method>(step, observation, modes_, z, from, to, room_);
    return done && is_finite(to.merged) ? Status::ok : Status::numerical;
  }

  ModeTable<S> modes_;
  Workspace<S, double> room_;
  std::vector<Observation<Reduced<S>>> reduced_;
  std::vector<const Observation<Reduced<S>>*> reduced_pointers_;
  Measured<Reduced<S>> present_;
  State<S, double> from_, to_;
};

}  // namespace surefix::switching
