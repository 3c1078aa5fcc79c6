// Integrity of the snapshot test (Lacresse, Grall & Nikiforov 2005, section 5.2), of one epoch.
//
// A fault of satellite i is critical from v_i* on: below it, a positioning failure |l̂ − l| > L/2 is
// rarer than p_r, whether or not the test sees it; above it the test must miss it no oftener than
// γ. All satellites share one critical shift of l̂, μ*, from which v_i* = μ*/|s_i|.
#pragma once

#include <array>

#include "surefix/raim/tangent_error.hpp"

namespace surefix::raim {

struct SnapshotIntegrity {
  std::array<double, max_satellites> critical_bias;  ///< v_i* [m], infinite where harmless
  std::array<double, max_satellites> missed;         ///< p(i, v_i*)
  double p_star;                                     ///< the largest
  /// Largest shift of l̂ by a fault of √λ = 1 [m]; infinite if one is harmful and not seen.
  double slope;
  /// Noncentrality of the critical fault that is seen least.
  double noncentrality;
};

/// v_i*, p(i, v_i*) and p* of an epoch with `degrees` ≥ 1.
[[nodiscard]] SnapshotIntegrity snapshot_integrity(const Geometry& geometry,
                                                   const MonitorSettings& settings,
                                                   const MonitorTables& tables) noexcept;

/// The smallest half-width L/2 [m] with which p* + e₁ ≤ γ and a healthy error is within it but for
/// p_r, given bounds of the linearisation error over it; infinite if there is none. It covers
/// faults of one satellite.
[[nodiscard]] double snapshot_protection(const Geometry& geometry, double slope,
                                         const TangentError::Bounds& bounds,
                                         const MonitorSettings& settings,
                                         const MonitorTables& tables) noexcept;

}  // namespace surefix::raim
