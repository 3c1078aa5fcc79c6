// The clocks of one epoch: each system of satellites has its own, which nobody knows.
#pragma once

#include <array>
#include <cstddef>

#include "surefix/raim/monitor_settings.hpp"

namespace surefix::raim {

/// Satellites in use: 1/σ [1/m] and system of each. Of whitened values a clock's column is 1/σ_i in
/// its own satellites, so that columns do not overlap and projecting them out is taking means.
class Clocks {
 public:
  void add(double root_weight, int system) noexcept {
    const auto i = static_cast<std::size_t>(n_++), c = static_cast<std::size_t>(system);
    root_[i] = root_weight;
    system_[i] = c;
    if (mass_[c] == 0.0) ++systems_;
    mass_[c] += root_weight * root_weight;
  }

  [[nodiscard]] int size() const noexcept { return n_; }
  [[nodiscard]] int systems() const noexcept { return systems_; }
  /// 1/σ_i [1/m].
  [[nodiscard]] double root_weight(int i) const noexcept { return root_[at(i)]; }
  /// Projection on the clocks' columns.
  [[nodiscard]] double hat(int i, int j) const noexcept {
    if (system_[at(i)] != system_[at(j)]) return 0.0;
    return root_[at(i)] * root_[at(j)] / mass_[system_[at(i)]];
  }
  /// y (n, whitened) less what clocks can explain. A satellite alone in its system keeps nothing.
  void remove(double* y) const noexcept {
    std::array<double, max_systems> mean{};
    for (int i = 0; i < n_; ++i) mean[system_[at(i)]] += root_[at(i)] * y[i];
    for (std::size_t c = 0; c < mean.size(); ++c)
      if (mass_[c] > 0.0) mean[c] /= mass_[c];
    for (int i = 0; i < n_; ++i) y[i] -= root_[at(i)] * mean[system_[at(i)]];
  }
  /// The clock of a system that explains y best [m]; 0 of one that is not there.
  [[nodiscard]] double mean(int system, const double* y) const noexcept {
    const auto c = static_cast<std::size_t>(system);
    double sum = 0.0;
    for (int i = 0; i < n_; ++i)
      if (system_[at(i)] == c) sum += root_[at(i)] * y[i];
    return mass_[c] > 0.0 ? sum / mass_[c] : 0.0;
  }

 private:
  [[nodiscard]] static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  int n_ = 0;
  int systems_ = 0;
  std::array<double, max_satellites> root_;
  std::array<std::size_t, max_satellites> system_;
  std::array<double, max_systems> mass_{};  // Σ 1/σ²
};

}  // namespace surefix::raim
