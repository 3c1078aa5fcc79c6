// The best place in K, and the others that a test does not tell from it.
//
// √S(l), the length of what no clock explains, falls no faster than κ ≥ sup ‖(I − clocks) d'/σ‖:
// from l there is no place below a level within (√S(l) − level)/κ. Strides of that length pass none
// over, and are long where the solution is far; near it √S changes by a twelfth of the level in
// each, and minima with nothing higher than that between them may count as one.
#pragma once

#include "surefix/raim/fix.hpp"

namespace surefix::raim {

struct Search {
  Fix fix;  ///< of least Λ; not ok where there is none in K
  /// Distance of the farthest other minimum in K, its ends included, that passes the test of α [m];
  /// 0 if there is none, infinite if K is too long to be looked through.
  double rival = 0.0;
};

/// At most 4096 strides.
[[nodiscard]] Search search(const Track& track, const Satellite* satellites,
                            const Selection& selection, const MonitorSettings& settings,
                            const MonitorTables& tables, const Whereabouts& where) noexcept;

}  // namespace surefix::raim
