// Sizes of a switching system: fixed ones for onboard code, any for what is read at run time.
#pragma once

#include <array>
#include <type_traits>
#include <vector>

#include "surefix/core/linear_sizes.hpp"

namespace surefix::switching {

/// n states, M modes, m measured components; everything lies inside the objects.
template <int States, int Modes, int Measured = 1>
struct Sizes : LinearSizes<States, Measured> {
  static constexpr int M = Modes;
};

/// Known at run time. What grows with the modes, and the matrices of the steps, are taken from the
/// heap when they are made.
struct AnySizes : AnyLinearSizes {
  static constexpr int M = Eigen::Dynamic;
};

/// One of each mode.
template <class T, int Count>
using Bank = std::conditional_t<
    Count == Eigen::Dynamic, std::vector<T>,
    std::array<T, static_cast<std::size_t>(Count == Eigen::Dynamic ? 1 : Count)>>;

/// M of one, M × M of the other; Dynamic stays so.
constexpr int squared(int M) { return M == Eigen::Dynamic ? M : M * M; }

template <class B>
void resize(B& bank, int count) {
  if constexpr (std::is_same_v<B, std::vector<typename B::value_type>>)
    bank.resize(static_cast<std::size_t>(count));
}

template <class S, class Lane = double>
using Belief = BeliefOf<S, Lane>;
template <class S>
using Transition = TransitionOf<S>;
template <class S, class Lane = double>
using Measured = MeasuredOf<S, Lane>;

constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace surefix::switching
