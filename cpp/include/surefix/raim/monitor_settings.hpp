// What a monitor promises, and every number that follows from it alone.
#pragma once

#include <array>
#include <cstddef>

#include "surefix/core/status.hpp"
#include "surefix/raim/power.hpp"

namespace surefix::raim {

inline constexpr int max_satellites = 64;
inline constexpr int max_systems = 8;
inline constexpr int max_set = 4;  ///< satellites that may be taken out together

/// Probabilities are per epoch.
struct MonitorSettings {
  double length = 50.0;       ///< L of the along-track protection interval [m]
  double false_alarm = 1e-5;  ///< α
  double missed = 1e-3;       ///< γ, bound on the probability that a critical fault is missed
  double risk = 1e-7;         ///< p_r
  double fault_probability = 1e-4;  ///< p_f, of each satellite
  /// Satellites faulty at once that the protection level covers, 1 or 2; 0: the snapshot test
  /// alone, as in the paper.
  int max_faults = 2;
  int max_excluded = 2;    ///< satellites that may be taken out, 0 … max_set
  double interval = 25.0;  ///< half-width of K around the estimate, for e₁ and e₂ [m]
  double rotation = 0.0;   ///< see `look`

  [[nodiscard]] ConfigStatus check() const noexcept;
};

/// Constants of a monitor for every number of satellites and degrees of freedom. Computed once.
class MonitorTables {
 public:
  explicit MonitorTables(const MonitorSettings& settings) noexcept;

  /// The χ² test of α.
  [[nodiscard]] const ChiSquaredTest& test(int degrees) const noexcept {
    return at(test_, degrees);
  }
  /// √λ of the fault that it misses with probability γ.
  [[nodiscard]] double detected(int degrees) const noexcept { return at(detected_, degrees); }
  /// K with which |l̂ − l̂_J| ≤ K σ for all sets J of n satellites, but for α.
  [[nodiscard]] double separation(int n) const noexcept { return at(separation_, n); }
  /// The part of p_r for the outcome that `excluded` of n satellites in view were taken out. Of
  /// p_r less P(more than max_faults of n are faulty), which no hypothesis covers, half is for none
  /// taken out, the other half shared by all sets that could be: a union bound over what the data
  /// may choose. Not positive: no protection level.
  [[nodiscard]] double share(int n, int excluded) const noexcept {
    return excluded == 0 ? at(share_none_, n) : at(share_set_, n);
  }
  /// K of P(X > K) = p_r/p_f, infinite where p_r ≥ p_f.
  [[nodiscard]] double tolerated() const noexcept { return tolerated_; }

 private:
  template <class T>
  using Table = std::array<T, max_satellites + 1>;
  template <class T>
  [[nodiscard]] static const T& at(const Table<T>& table, int i) noexcept {
    return table[static_cast<std::size_t>(i)];
  }
  Table<ChiSquaredTest> test_{};
  Table<double> detected_{}, separation_{}, share_none_{}, share_set_{};
  double tolerated_ = 0.0;
};

}  // namespace surefix::raim
