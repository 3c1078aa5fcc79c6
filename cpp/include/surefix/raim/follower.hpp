// Epoch after epoch: the monitor with what is known of the motion.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "surefix/raim/track_raim.hpp"

namespace surefix::raim {

/// Knows an interval that holds the vehicle: it grows with the time at `max_speed`, and shrinks to
/// the protection level (L if that is longer), rivals included, of each position that may be used
/// and has one. Positions are looked for in it, and as far beyond as they may be off. On a track
/// that comes near to itself only that tells the branches apart. A plain value; the monitor must
/// outlive it.
class Follower {
 public:
  /// `max_speed` [m/s] along the track; infinity: anywhere. `near`: mileage at the beginning [m],
  /// right to within L; NaN if it is not known.
  Follower(const TrackRaim& monitor, double max_speed, double near) noexcept
      : monitor_(&monitor), max_speed_(max_speed), place_(near), off_(monitor.settings().length) {
    if (!std::isnan(near)) low_ = near - off_, high_ = near + off_;
  }

  /// Judges the epoch at `time` [s]. One whose time is not finite, or before the last one's, is
  /// counted and not available (`Solvable::time`), and nothing changes: how far the vehicle may
  /// have gone until then is not known.
  [[nodiscard]] Verdict judge(double time, const Satellite* satellites, int n) noexcept {
    if (!std::isfinite(time) || time < time_) {
      ++refused_;
      Verdict none;
      none.status = Solvable::time;
      return none;
    }
    const double gone = time > time_ ? max_speed_ * (time - time_) : 0.0;
    time_ = time;
    low_ -= gone;
    high_ += gone;
    const Verdict verdict = monitor_->judge(satellites, n, {place_, low_ - off_, high_ + off_});
    if (verdict.declared == Declared::ok || verdict.declared == Declared::excluded) {
      place_ = verdict.along;
      const double level =
          monitor_->settings().max_faults > 0 ? verdict.protection : verdict.snapshot_protection;
      if (std::isfinite(level)) {
        off_ = std::max(monitor_->settings().length, level);
        const double low = place_ - off_, high = place_ + off_;
        const bool apart = low > high_ || high < low_;  // rarer than the risk: the new one is right
        low_ = apart ? low : std::max(low_, low);
        high_ = apart ? high : std::min(high_, high);
      }
    }
    return verdict;
  }

  /// The last position that may be used, NaN before there is one [m].
  [[nodiscard]] double place() const noexcept { return place_; }
  /// Where the vehicle is, as of the last epoch [m].
  [[nodiscard]] double low() const noexcept { return low_; }
  [[nodiscard]] double high() const noexcept { return high_; }
  /// How many epochs were refused for their time.
  [[nodiscard]] std::int64_t refused() const noexcept { return refused_; }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();

  const TrackRaim* monitor_;
  double max_speed_;
  double place_;
  double off_;  // by how much a position may be off
  double low_ = -infinity, high_ = infinity;
  double time_ = std::numeric_limits<double>::quiet_NaN();  // before the first one
  std::int64_t refused_ = 0;
};

}  // namespace surefix::raim
