// Deterministic adversarial sequences of (transition, row, variance).
#pragma once
#include <cmath>
#include <cstdint>
#include <random>

#include "model.hpp"

enum Kind { sweep, year, repeat, collinear, components, mixed, kinds };
inline const char* const kind_name[] = {"sweep",     "year gap",   "repeat",
                                        "collinear", "components", "mixed"};

struct Random {
  std::mt19937_64 bits;
  double uniform(double lo, double hi) { return lo + (hi - lo) * 0x1p-53 * (bits() >> 11); }
  double log(double lo, double hi) { return std::pow(10, uniform(lo, hi)); }
  int below(int n) { return int(bits() % n); }
};

template <int n>
struct Step {
  Transition<n> t;
  Vector<double, n> h{};
  double r = 1;
  bool relative = false;  // r is a multiple of the predicted h P h'
};

template <int n>
Transition<n> transition(double dt, double q2) {
  Transition<n> t;
  t.dt = dt;
  t.q2 = q2;
  for (int i = 0; i < n - 2; ++i) {
    const double tau = std::pow(10., 3 + 0.5 * i);  // 1e3 s ... 3e6 s
    t.decay[i] = std::exp(-dt / tau);
    t.noise[i] = -0.1 * std::expm1(-2 * dt / tau);
  }
  return t;
}

// n = 2: the speed itself.  n = 10: sensor s reads speed + v * scale_s + bias_s.
template <int n>
Vector<double, n> sensor(int s, double v) {
  Vector<double, n> h{};
  h[0] = 1;
  if constexpr (n > 2) {
    h[2 + 2 * s] = v;
    h[3 + 2 * s] = 1;
  }
  return h;
}

template <int n>
class Sequence {
 public:
  Matrix<double, n> U0{};
  Vector<double, n> D0{};

  // correlated: P0 has every other D_j at 1/condition and U filled with +-1ish;
  // otherwise P0 is diagonal with variances from 1 down to 1/condition.
  Sequence(Kind kind, double condition, bool correlated, double q2, std::uint64_t seed)
      : kind_(kind), q2_(q2), random_{std::mt19937_64(seed)} {
    for (int i = 0; i < n; ++i) {
      U0[i][i] = 1;
      D0[i] = correlated ? (i % 2 ? 1 : 1 / condition)
                         : std::pow(condition, -double(seed % 2 ? i : n - 1 - i) / (n - 1));
      for (int j = i + 1; j < n && correlated; ++j)
        U0[i][j] = (random_.below(2) ? 1 : -1) * random_.uniform(0.9, 1.1);
    }
  }

  Step<n> next() {
    const Kind kind = kind_ == mixed ? Kind(random_.below(mixed)) : kind_;
    const long i = count_++;
    double dt = 1e-3;
    Step<n> s;
    s.h = sensor<n>(random_.below(4), random_.uniform(-50, 50));
    switch (kind) {
      case sweep:  // everything at once: 30 decades of r, 4 of dt
        dt = random_.log(-3, 1);
        s.r = random_.log(-18, 12);
        break;
      case year:  // a year's gap, two very precise readings, then milliseconds
        s.relative = true;
        if (kind_ == mixed ? random_.below(20) == 0 : i % 100 == 0) dt = 3e7;
        s.r = i % 100 < 2 ? 1e-18 : random_.log(-3, 3);
        break;
      case repeat:  // the same quantity over and over, without process noise
        s.h = sensor<n>(0, 30);
        dt = i % 20 ? 0 : 1;
        s.r = 1e-18;
        break;
      case collinear:  // rows that differ in the eighth digit
        s.h = sensor<n>(0, i % 2 ? 30 : 30 * (1 + 1e-8));
        if (i % 2) s.h[1] = 1e-8;
        s.r = random_.log(-18, -6);
        break;
      default:  // any one component, so the measured index visits both triangles
        s.h = {};
        s.h[random_.below(n)] = 1;
        s.r = random_.log(-18, 0);
    }
    s.t = transition<n>(dt, q2_);
    return s;
  }

 private:
  Kind kind_;
  double q2_;
  Random random_;
  long count_ = 0;
};
