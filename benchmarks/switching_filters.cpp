// W2 and W3 as an engineer would write them by hand. No likelihood floors, but nothing is checked:
// no missing measurement, no overflow, no weights that vanish.
#include <cmath>
#include <cstddef>

/// W2: scalar Kalman filters, z (runs, T); x and P (runs, T). Blocks of series side by side, time
/// outermost, in arrays of their own.
extern "C" void w2_blocked(const double* z, std::size_t runs, std::size_t T, double a, double q,
                           double r, double P0, double* x, double* P) {
  constexpr std::size_t width = 16;
  double zb[width], xb[width], Pb[width];
  for (std::size_t first = 0; first < runs; first += width) {
    const std::size_t count = runs - first < width ? runs - first : width;
    for (std::size_t s = 0; s < width; ++s) {
      xb[s] = 0.0;
      Pb[s] = P0;
      zb[s] = 0.0;
    }
    for (std::size_t k = 0; k < T; ++k) {
      for (std::size_t s = 0; s < count; ++s) zb[s] = z[(first + s) * T + k];
      if (k > 0) {
        for (std::size_t s = 0; s < width; ++s) {
          xb[s] = a * xb[s];
          Pb[s] = a * a * Pb[s] + q;
        }
      }
      for (std::size_t s = 0; s < width; ++s) {
        const double K = Pb[s] / (Pb[s] + r);
        xb[s] += K * (zb[s] - xb[s]);
        Pb[s] = r * K;
      }
      for (std::size_t s = 0; s < count; ++s) x[(first + s) * T + k] = xb[s];
      for (std::size_t s = 0; s < count; ++s) P[(first + s) * T + k] = Pb[s];
    }
  }
}

/// W3: an IMM of three modes (γ = 1, δ = 1; γ = 1, δ = C; γ = 0, δ = 1) on one scalar series.
/// Writes x (T), P (T) and the mode probabilities (T, 3); returns the log-likelihood.
extern "C" double w3_loop(const double* z, std::size_t T, const double* p, const double* initial,
                          double a, double q, double r, double C, double P0, double* x_out,
                          double* P_out, double* mode_out) {
  double x[3] = {0.0, 0.0, 0.0}, P[3] = {P0, P0, P0};
  double mode[3] = {initial[0], initial[1], initial[2]}, total = 0.0;
  const double R[3] = {r, r * C, r}, log_r = std::log(r);
  for (std::size_t k = 0; k < T; ++k) {
    double prior[3], log_weight[3], most = -1e300;
    if (k == 0) {
      for (int j = 0; j < 3; ++j) prior[j] = mode[j];
    } else {
      double x0[3], P0_[3];
      for (int j = 0; j < 3; ++j) {
        double m0 = mode[0] * p[j], m1 = mode[1] * p[3 + j], m2 = mode[2] * p[6 + j];
        prior[j] = m0 + m1 + m2;
        const double inverse = 1.0 / prior[j];
        m0 *= inverse;
        m1 *= inverse;
        m2 *= inverse;
        x0[j] = m0 * x[0] + m1 * x[1] + m2 * x[2];
        const double d0 = x[0] - x0[j], d1 = x[1] - x0[j], d2 = x[2] - x0[j];
        P0_[j] = m0 * (P[0] + d0 * d0) + m1 * (P[1] + d1 * d1) + m2 * (P[2] + d2 * d2);
      }
      for (int j = 0; j < 3; ++j) {
        x[j] = a * x0[j];
        P[j] = a * a * P0_[j] + q;
      }
    }
    for (int j = 0; j < 2; ++j) {
      const double S = P[j] + R[j], inverse = 1.0 / S, K = P[j] * inverse, nu = z[k] - x[j];
      x[j] += K * nu;
      P[j] = R[j] * K;
      log_weight[j] = -0.5 * (nu * nu * inverse + std::log(S));
    }
    log_weight[2] = -0.5 * (z[k] * z[k] / r + log_r);
    for (int j = 0; j < 3; ++j) most = log_weight[j] > most ? log_weight[j] : most;
    double sum = 0.0;
    for (int j = 0; j < 3; ++j) {
      mode[j] = prior[j] * std::exp(log_weight[j] - most);
      sum += mode[j];
    }
    const double inverse = 1.0 / sum;
    for (int j = 0; j < 3; ++j) mode[j] *= inverse;
    total += most + std::log(sum);
    const double mean = mode[0] * x[0] + mode[1] * x[1] + mode[2] * x[2];
    double variance = 0.0;
    for (int j = 0; j < 3; ++j) variance += mode[j] * (P[j] + (x[j] - mean) * (x[j] - mean));
    x_out[k] = mean;
    P_out[k] = variance;
    for (int j = 0; j < 3; ++j) mode_out[3 * k + static_cast<std::size_t>(j)] = mode[j];
  }
  return total - static_cast<double>(T) * 0.91893853320467274178;
}
