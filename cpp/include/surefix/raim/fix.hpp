// The along-track position of one epoch: iterated weighted least squares on the track
// (Lacresse, Grall & Nikiforov 2005, section 5.1).
#pragma once

#include <limits>

#include "surefix/raim/geometry.hpp"
#include "surefix/raim/sight.hpp"
#include "surefix/raim/verdict.hpp"

namespace surefix::raim {

/// Satellites in use of those given: their indices.
struct Selection {
  int size = 0;
  std::array<int, max_satellites> index;
};

struct Fix {
  Solvable status = Solvable::too_few;
  double along = 0.0;
  Geometry geometry;                            // at `along`
  std::array<double, max_satellites> residual;  // (I − P) y at `along`, whitened
  std::array<double, max_systems> clock{};      // [m]
  double statistic = 0.0;                       // Λ

  [[nodiscard]] bool ok() const noexcept { return status == Solvable::ok; }
};

/// K: where the solution may be, and where the iteration begins [m]; NaN: at the best of some
/// dozens of places in K.
struct Whereabouts {
  double near = std::numeric_limits<double>::quiet_NaN();
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  double step = 1000.0;  ///< of the iteration, at most
};

/// Solves for l and the clocks: Newton's steps on ‖(I − clocks) y(l)‖², halved until it falls.
[[nodiscard]] Fix find_fix(const Track& track, const Satellite* satellites,
                           const Selection& selection, const MonitorSettings& settings,
                           const Whereabouts& where) noexcept;

}  // namespace surefix::raim
