// Which satellites to take out after an alarm.
//
// Without the satellites of a set J the statistic is Λ_J = Λ − r_Jᵀ (I − P)_JJ⁻¹ r_J. Of all sets
// of one size the one with the least Λ_J is the most likely; with its faulty satellites in it, Λ_J
// is χ² and the chosen one is smaller still, so that a retest at α does not alarm oftener than α.
// That the wrong set may be chosen is paid for by the protection level, whose risk is divided among
// all sets that could have been (`MonitorTables::share`).
#pragma once

#include <array>

#include "surefix/raim/geometry.hpp"

namespace surefix::raim {

/// Indices of `size` satellites, increasing.
struct SatelliteSet {
  int size = 0;
  std::array<int, max_set> member{};
};

/// Of the sets of `size` satellites ≤ max_set the one with the least Λ_J, given the whitened
/// residuals r (n). A set of size 0: none whose satellites are all seen. Its loops: n over `size`.
[[nodiscard]] SatelliteSet best_exclusion(const Geometry& geometry, const double* r,
                                          int size) noexcept;

}  // namespace surefix::raim
