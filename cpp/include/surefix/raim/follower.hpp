// Epoch after epoch: the monitor with what is known of the motion.
#pragma once

#include "surefix/raim/track_raim.hpp"

namespace surefix::raim {

/// Looks for the position where it can be: within the distance that the vehicle may have gone since
/// the last position that may be used. On a track that comes near to itself only that tells the
/// branches apart. A plain value; the monitor must outlive it.
class Follower {
 public:
  /// `max_speed` [m/s] along the track; infinity: anywhere. `near`: mileage at the beginning [m],
  /// NaN if that is not known.
  Follower(const TrackRaim& monitor, double max_speed, double near) noexcept
      : monitor_(&monitor), max_speed_(max_speed), place_(near) {}

  /// Judges the epoch at `time` [s], no earlier than the one before.
  [[nodiscard]] Verdict judge(double time, const Satellite* satellites, int n) noexcept {
    if (std::isnan(time_)) time_ = time;
    Whereabouts where{place_};
    if (!std::isnan(place_)) {
      const double reach = max_speed_ * std::max(time - time_, 0.0) + monitor_->settings().length;
      if (reach >= 0.0) where.low = place_ - reach, where.high = place_ + reach;
    }
    const Verdict verdict = monitor_->judge(satellites, n, where);
    if (verdict.declared == Declared::ok || verdict.declared == Declared::excluded) {
      place_ = verdict.along;
      time_ = time;
    }
    return verdict;
  }

  /// The last position that may be used, NaN before there is one.
  [[nodiscard]] double place() const noexcept { return place_; }
  /// Of that, or the first epoch's [s].
  [[nodiscard]] double time() const noexcept { return time_; }

 private:
  const TrackRaim* monitor_;
  double max_speed_;
  double place_;
  double time_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace surefix::raim
