// The two models of the experiment, and the small dense types all forms share.
//
//   n = 2   speed and acceleration, white noise on the acceleration's rate:
//             F = [1 dt; 0 1],  Q = q2 [dt^3/3 dt^2/2; dt^2/2 dt].
//   n = 10  the same, plus eight independent first-order Gauss-Markov states:
//             F_ii = decay_i, Q_ii = noise_i.  They are the scale and the bias
//             of four speed sensors; a sensor's row has three nonzeros.
//
// `decay` and `noise` are inputs, identical for every form and for the reference;
// Q of the speed block is formed from dt by each form in its own arithmetic.
#pragma once
#include <array>

template <class T, int n>
using Vector = std::array<T, n>;
template <class T, int n>
using Matrix = std::array<std::array<T, n>, n>;

template <int n>
struct Transition {
  double dt = 0;
  double q2 = 0;
  std::array<double, n - 2> decay{};
  std::array<double, n - 2> noise{};
};

template <class T, int n>
T dot(const Vector<double, n>& h, const Vector<T, n>& v) {
  T sum = h[0] * v[0];
  for (int i = 1; i < n; ++i) sum += h[i] * v[i];
  return sum;
}

template <class T, int n>
void predict_state(Vector<T, n>& x, const Transition<n>& f) {
  x[0] += f.dt * x[1];
  for (int i = 2; i < n; ++i) x[i] *= f.decay[i - 2];
}
