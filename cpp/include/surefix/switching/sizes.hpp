// Sizes of a switching system: fixed ones for onboard code, any for what is read at run time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <type_traits>
#include <vector>

#include "surefix/core/gaussian.hpp"
#include "surefix/core/transition.hpp"

namespace surefix::switching {

/// n states, M modes, m measured components; everything lies inside the objects.
template <int States, int Modes, int Measured = 1>
struct Sizes {
  static constexpr int n = States, max_n = States, stored_n = States;
  static constexpr int M = Modes;
  static constexpr int m = Measured, max_m = Measured, stored_m = Measured;
};

/// Known at run time. What grows with the modes, and the matrices of the steps, are taken from the
/// heap when they are made.
struct AnySizes {
  static constexpr int n = Eigen::Dynamic, max_n = 32, stored_n = Eigen::Dynamic;
  static constexpr int M = Eigen::Dynamic;
  static constexpr int m = Eigen::Dynamic, max_m = 32, stored_m = Eigen::Dynamic;
};

/// As S, with some measured components missing; made in the steps, so without heap.
template <class S>
struct Reduced : S {
  static constexpr int m = Eigen::Dynamic;
  static constexpr int stored_n = S::max_n, stored_m = S::max_m;
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
using Belief = Gaussian<S::n, Lane, S::max_n>;

/// F and Q of a step.
template <class S>
using Transition = DenseTransition<S::n, S::max_n, S::stored_n>;

/// One value of each measured component.
template <class S, class Lane = double>
using Measured = Eigen::Matrix<Lane, S::m, 1, 0, S::max_m, 1>;

constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace surefix::switching
