// Protection from fault hypotheses (multiple-hypothesis solution separation), of one epoch.
//
// A hypothesis is a set J of one or two faulty satellites. The solution without them,
//   l̂_J = l̂ − e_J (I − P)_JJ⁻¹ r_J,   σ_J² = σ_l² + e_J (I − P)_JJ⁻¹ e_Jᵀ,
// does not know of their faults, and with no fault |l̂ − l̂_J| ≤ T_J = K σ_ss, σ_ss² = σ_J² − σ_l².
// While it is, an error beyond PL needs one of l̂_J beyond PL − T_J:
//   2 Q(PL/σ_l − c) + Σ_J p_f^|J| 2 Q((PL − T_J)/σ_J − c) = share of the risk.
// c bounds what the track's bend does to an estimate, in its standard deviations, for all l within
// `interval` or PL of l̂, whichever is longer; where PL grows faster than that there is none.
#pragma once

#include <array>
#include <cmath>

#include "surefix/raim/geometry.hpp"
#include "surefix/raim/tail_root.hpp"
#include "surefix/raim/tangent_error.hpp"

namespace surefix::raim {

/// The solution without a set of satellites.
struct SetSolution {
  enum class Kind { seen, harmless, blind };
  Kind kind;              ///< `blind`: l̂ suffers from faults in the set that no residual shows
  double shift = 0.0;     ///< l̂_J − l̂ [m]
  double variance = 0.0;  ///< σ_ss² [m²]
};

/// Without satellite i, or without i and j. `r` (n): whitened residuals.
[[nodiscard]] SetSolution without(const Geometry& geometry, const double* r, int i) noexcept;
[[nodiscard]] SetSolution without(const Geometry& geometry, const double* r, int i, int j) noexcept;

/// All hypotheses of one solution.
class Separation {
 public:
  /// `r` (n): whitened residuals.
  Separation(const Geometry& geometry, const double* r, const MonitorSettings& settings,
             const MonitorTables& tables) noexcept;

  /// Whether |l̂ − l̂_J| > T_J for some J.
  [[nodiscard]] bool alarm() const noexcept { return alarm_; }
  /// PL [m], infinite where there is none. `share`: the part of p_r that it may use
  /// (`MonitorTables::share`).
  [[nodiscard]] double protection(const TangentError& error, double share) const noexcept;

 private:
  /// The sum above without p_r, and its slope; `bent`: c.
  [[nodiscard]] TailValue tail(double x, double bent) const noexcept;
  [[nodiscard]] double level(double budget, double bent) const noexcept;
  void add(const SetSolution& set, double K, bool single) noexcept;

  static constexpr std::size_t most = max_satellites * (max_satellites + 1) / 2;
  double sigma_, prior_, blind_ = 0.0;  // blind: P of the sets that no residual shows
  bool alarm_ = false;
  int count_ = 0, singles_ = 0;
  std::array<double, most> threshold_, set_sigma_;  // T_J, σ_J, single satellites first
};

}  // namespace surefix::raim
