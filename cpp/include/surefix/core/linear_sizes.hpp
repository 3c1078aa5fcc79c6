// Sizes of a linear system of n states and m measured components: fixed ones for onboard code, any
// for what is read at run time.
#pragma once

#include <Eigen/Core>

#include "surefix/core/gaussian.hpp"
#include "surefix/core/transition.hpp"

namespace surefix {

/// Everything lies inside the objects.
template <int States, int Measured = 1>
struct LinearSizes {
  static constexpr int n = States, max_n = States, stored_n = States;
  static constexpr int m = Measured, max_m = Measured, stored_m = Measured;
};

/// Known at run time. The matrices of the steps are taken from the heap when they are made.
struct AnyLinearSizes {
  static constexpr int n = Eigen::Dynamic, max_n = 32, stored_n = Eigen::Dynamic;
  static constexpr int m = Eigen::Dynamic, max_m = 32, stored_m = Eigen::Dynamic;
};

/// As S, with some measured components missing; made in the steps, so without heap.
template <class S>
struct Reduced : S {
  static constexpr int m = Eigen::Dynamic;
  static constexpr int stored_n = S::max_n, stored_m = S::max_m;
};

template <class S, class Lane = double>
using BeliefOf = Gaussian<S::n, Lane, S::max_n>;

/// F and Q of a step.
template <class S>
using TransitionOf = DenseTransition<S::n, S::max_n, S::stored_n>;

/// One value of each measured component.
template <class S, class Lane = double>
using MeasuredOf = Eigen::Matrix<Lane, S::m, 1, 0, S::max_m, 1>;

}  // namespace surefix
