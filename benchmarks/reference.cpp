// W1 as an engineer would unroll it by hand: two states, plain covariance update, one logarithm for
// each measurement. Writes x (N, 2) and P (N, 2, 2); returns the log-likelihood.
#include <cmath>
#include <cstddef>
#include <cstdint>

extern "C" double w1_reference(const double* time, const std::int32_t* sensor, const double* value,
                               std::size_t count, const double* variance, double density, double* x,
                               double* P) {
  double x0 = 0.0, x1 = 0.0, p00 = 1.0, p01 = 0.0, p11 = 1.0, previous = time[0], sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double dt = time[i] - previous;
    previous = time[i];
    x0 += dt * x1;
    p00 += dt * (2.0 * p01 + dt * p11) + density * dt * dt * dt / 3.0;
    p01 += dt * p11 + density * dt * dt / 2.0;
    p11 += density * dt;
    const double S = p00 + variance[sensor[i]], inverse = 1.0 / S;
    const double k0 = p00 * inverse, k1 = p01 * inverse, innovation = value[i] - x0;
    x0 += k0 * innovation;
    x1 += k1 * innovation;
    p11 -= k1 * p01;
    p01 -= k0 * p01;
    p00 -= k0 * p00;
    sum += std::log(S) + innovation * innovation * inverse;
    x[2 * i] = x0;
    x[2 * i + 1] = x1;
    P[4 * i] = p00;
    P[4 * i + 1] = P[4 * i + 2] = p01;
    P[4 * i + 3] = p11;
  }
  return -0.5 * (sum + static_cast<double>(count) * 1.83787706640934548356);
}
