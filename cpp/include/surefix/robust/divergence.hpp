// The Kullback-Leibler divergence between two Gaussians over some of the states.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace surefix::robust {

/// Scratch for Gaussians of up to n states; matrices are n × n, column by column.
class Divergence {
 public:
  Divergence() = default;
  explicit Divergence(int n)
      : n_(n), L_(static_cast<std::size_t>(n * n)), column_(static_cast<std::size_t>(n)) {}

  /// Keeps the Cholesky factor L of P over the states `active`; returns log |P| there. A variance
  /// of zero counts as 1e-30: distances are for choosing, nothing is estimated from them.
  double factorise(const double* P, const std::vector<int>& active) noexcept {
    const std::size_t m = active.size();
    double log_determinant = 0.0;
    for (std::size_t j = 0; j < m; ++j)
      for (std::size_t i = j; i < m; ++i) {
        double sum = P[active[j] * n_ + active[i]];
        for (std::size_t k = 0; k < j; ++k) sum -= L_[i * m + k] * L_[j * m + k];
        if (i > j) {
          L_[i * m + j] = sum / L_[j * m + j];
          continue;
        }
        const double pivot = std::max(sum, 1e-30);
        log_determinant += std::log(pivot);
        L_[j * m + j] = std::sqrt(pivot);
      }
    return log_determinant;
  }

  /// D(j‖i) of N(x_j, P_j) from N(x_i, P_i), the one factorised last; `log_ratio`: log |P_i|/|P_j|.
  [[nodiscard]] double operator()(const double* xj, const double* Pj, const double* xi,
                                  const std::vector<int>& active, double log_ratio) noexcept {
    const std::size_t m = active.size();
    double sum = log_ratio - static_cast<double>(m);
    for (std::size_t a = 0; a < m; ++a) column_[a] = xj[active[a]] - xi[active[a]];
    forward(m);
    for (std::size_t a = 0; a < m; ++a) sum += column_[a] * column_[a];
    for (std::size_t c = 0; c < m; ++c) {  // tr L⁻ᵀL⁻¹P_j, column by column
      for (std::size_t a = 0; a < m; ++a) column_[a] = Pj[active[c] * n_ + active[a]];
      forward(m);
      for (std::size_t a = m; a-- > c;) {
        for (std::size_t k = a + 1; k < m; ++k) column_[a] -= L_[k * m + a] * column_[k];
        column_[a] /= L_[a * m + a];
      }
      sum += column_[c];
    }
    return std::max(0.5 * sum, 0.0);
  }

 private:
  void forward(std::size_t m) noexcept {
    for (std::size_t a = 0; a < m; ++a) {
      for (std::size_t k = 0; k < a; ++k) column_[a] -= L_[a * m + k] * column_[k];
      column_[a] /= L_[a * m + a];
    }
  }

  int n_ = 0;
  std::vector<double> L_, column_;
};

}  // namespace surefix::robust
