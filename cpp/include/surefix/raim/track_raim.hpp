// Integrity of satellite positions on a known track: one epoch in, one verdict out.
//
// No heap, no exception; every loop is bounded by max_satellites, by the number of sets of at most
// max_excluded satellites, by 4096 strides along K, and by the logarithm of the track's number of
// vertices.
#pragma once

#include "surefix/raim/exclusion.hpp"
#include "surefix/raim/protection.hpp"
#include "surefix/raim/search.hpp"
#include "surefix/raim/separation.hpp"

namespace surefix::raim {

class TrackRaim {
 public:
  /// `settings.check()` must be ok; the track must outlive the monitor.
  TrackRaim(const Track& track, const MonitorSettings& settings) noexcept
      : track_(&track), settings_(settings), tables_(settings) {}

  /// Judges n satellites; those with a pseudorange, position or sigma that is not finite or beyond
  /// `farthest`, a sigma below `smallest_sigma`, or a system out of range, are not used. `where`:
  /// K, and where the iteration begins.
  [[nodiscard]] Verdict judge(const Satellite* satellites, int n,
                              const Whereabouts& where) const noexcept;

  [[nodiscard]] const MonitorSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const Track& track() const noexcept { return *track_; }

 private:
  [[nodiscard]] bool alarms(const Fix& fix) const noexcept {
    return fix.statistic >= tables_.test(fix.geometry.degrees()).threshold;
  }
  /// The solution without some of the satellites, if there is one that passes.
  [[nodiscard]] bool exclude(const Satellite* satellites, const Selection& all, const Fix& first,
                             const Whereabouts& where, Verdict& verdict) const noexcept;
  /// `share`: the part of p_r that the protection level may use.
  void describe(const Satellite* satellites, const Selection& selection, const Search& found,
                const Separation& separation, double share, Verdict& verdict) const noexcept;

  const Track* track_;
  MonitorSettings settings_;
  MonitorTables tables_;
};

}  // namespace surefix::raim
