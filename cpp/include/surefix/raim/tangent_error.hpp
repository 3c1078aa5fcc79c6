// What the tangent at the estimate leaves of a track that bends: 𝓔(l) = d(l) − d(l̂) − d'(l̂)(l − l̂).
#pragma once

#include <cmath>
#include <limits>

#include "surefix/raim/fix.hpp"

namespace surefix::raim {

/// Bounds for one solution, in standard deviations; everything given must outlive it.
class TangentError {
 public:
  struct Bounds {
    double parity;  ///< b ≥ ‖W 𝓔‖: by how much the statistic's √λ may be off
    double whole;  ///< c ≥ ‖(I − clocks) 𝓔‖: an estimate of variance σ² is off by σ c at most
  };
  TangentError(const Track& track, const Satellite* satellites, const Selection& selection,
               const Fix& fix, const MonitorSettings& settings) noexcept
      : track_(track),
        satellites_(satellites),
        selection_(selection),
        fix_(fix),
        settings_(settings),
        near_(over(settings.interval)) {}

  /// For all |l − l̂| ≤ half; between the samples by |𝓔''| ≤ ‖c''‖ + the turning of the lines of
  /// sight (section 4.3, certified).
  [[nodiscard]] Bounds over(double half) const noexcept;
  /// Over `interval`.
  [[nodiscard]] const Bounds& near() const noexcept { return near_; }

  /// A level that rests on bounds over at least itself: `level(bounds)` from those over `interval`
  /// on, as far as it takes; infinite if it always outgrows them.
  template <class Level>
  [[nodiscard]] double within(const Level& level) const noexcept {
    double half = settings_.interval;
    Bounds bounds = near_;
    for (int round = 0; round < 12; ++round) {
      const double found = level(bounds);
      if (!(found > half)) return found;
      if (!std::isfinite(found)) break;
      half = 1.05 * found;
      bounds = over(half);
    }
    return std::numeric_limits<double>::infinity();
  }

 private:
  const Track& track_;
  const Satellite* satellites_;
  const Selection& selection_;
  const Fix& fix_;
  const MonitorSettings& settings_;
  Bounds near_;
};

}  // namespace surefix::raim
