// (a)  P+ = P - b b' / S, upper triangle computed, then mirrored.
//
// Cheapest, and exact algebra.  A precise measurement makes P+ the small
// difference of two large numbers: the rounding left behind is of size
// eps * P, however small P+ should be.
#pragma once
#include "covariance.hpp"

template <class T, int n>
struct Plain : Covariance<T, n> {
  void update(const Vector<double, n>& h, double r, double z) {
    this->subtract_outer(this->correct_state(h, r, z));
  }
};
