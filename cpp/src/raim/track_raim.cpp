#include "surefix/raim/track_raim.hpp"

#include <algorithm>
#include <cmath>

namespace surefix::raim {
namespace {

constexpr double none = Verdict::none;

bool usable(const Satellite& s) noexcept {
  const double sum = s.position[0] + s.position[1] + s.position[2] + s.pseudorange + s.sigma;
  return std::isfinite(sum) && s.sigma > 0.0 && s.system >= 0 && s.system < max_systems;
}

Selection without_set(const Selection& all, const SatelliteSet& set) noexcept {
  Selection rest;
  for (int k = 0; k < all.size; ++k) {
    const auto* end = set.member.data() + set.size;
    if (std::find(set.member.data(), end, k) == end)
      rest.index[static_cast<std::size_t>(rest.size++)] = all.index[static_cast<std::size_t>(k)];
  }
  return rest;
}

}  // namespace

Verdict TrackRaim::judge(const Satellite* satellites, int n,
                         const Whereabouts& where) const noexcept {
  Verdict verdict;
  Selection all;
  for (int i = 0; i < n; ++i) {
    if (i >= max_satellites) {
      verdict.status = Solvable::too_many;
      return verdict;
    }
    if (usable(satellites[i])) all.index[static_cast<std::size_t>(all.size++)] = i;
  }
  verdict.used = all.size;
  const Fix first = fix(satellites, all, where);
  verdict.status = first.status;
  // A solution beyond K is as much of an alarm as a large residual: faults have moved it there.
  if (first.status == Solvable::off_track && first.geometry.size() > 0) {
    verdict.alarm = true;
    verdict.degrees = first.geometry.degrees();
    verdict.threshold = tables_.test(verdict.degrees).threshold;
    if (exclude(satellites, all, first, where, verdict)) verdict.status = Solvable::ok;
  }
  if (!first.ok()) return verdict;

  const ChiSquaredTest& test = tables_.test(first.geometry.degrees());
  verdict.statistic = first.statistic;
  verdict.degrees = first.geometry.degrees();
  verdict.threshold = test.threshold;
  verdict.alarm = alarms(first);
  const TangentError error(*track_, satellites, all, first, settings_.rotation);
  const Separation separation = separate(first.geometry, first.residual.data(), error, settings_,
                                         tables_, tables_.share(all.size, 0));
  verdict.separation_alarm = separation.alarm;
  verdict.declared = verdict.alarm || separation.alarm ? Declared::alarm : Declared::ok;
  if (verdict.declared == Declared::alarm && exclude(satellites, all, first, where, verdict))
    return verdict;
  describe(satellites, all, first, separation, where, verdict);
  return verdict;
}

Fix TrackRaim::fix(const Satellite* satellites, const Selection& selection,
                   const Whereabouts& where) const noexcept {
  if (!std::isnan(where.near) && turns(where))
    return find_fix(*track_, satellites, selection, settings_, {none, where.low, where.high});
  const Fix close = find_fix(*track_, satellites, selection, settings_, where);
  if (std::isnan(where.near) || close.status == Solvable::too_few || (close.ok() && !alarms(close)))
    return close;
  const Whereabouts all{none, where.low, where.high};
  const Fix anywhere = find_fix(*track_, satellites, selection, settings_, all);
  const bool better = anywhere.ok() && (!close.ok() || anywhere.statistic < close.statistic);
  return better ? anywhere : close;
}

bool TrackRaim::turns(const Whereabouts& where) const noexcept {
  const double low = std::max(where.low, track_->low()),
               high = std::min(where.high, track_->high());
  return low < high && track_->bend_bound(low, high) * (high - low) > 1.0;
}

bool TrackRaim::exclude(const Satellite* satellites, const Selection& all, const Fix& first,
                        const Whereabouts& where, Verdict& verdict) const noexcept {
  for (int size = 1; size <= settings_.max_excluded; ++size) {
    if (first.geometry.degrees() - size < 1) break;
    const SatelliteSet set = best_exclusion(first.geometry, first.residual.data(), size);
    if (set.size == 0) continue;
    const Selection rest = without_set(all, set);
    const double near = first.ok() ? first.along : none;
    const Fix again = fix(satellites, rest, {near, where.low, where.high});
    if (!again.ok() || alarms(again)) continue;
    const TangentError error(*track_, satellites, rest, again, settings_.rotation);
    const Separation separation = separate(again.geometry, again.residual.data(), error, settings_,
                                           tables_, tables_.share(all.size, size));
    if (separation.alarm) continue;
    verdict.declared = Declared::excluded;
    verdict.excluded = size;
    for (int k = 0; k < size; ++k) {
      const int member = set.member[static_cast<std::size_t>(k)];
      const int given = all.index[static_cast<std::size_t>(member)];
      verdict.taken_out[static_cast<std::size_t>(given)] = true;
    }
    describe(satellites, rest, again, separation, where, verdict);
    return true;
  }
  return false;
}

void TrackRaim::describe(const Satellite* satellites, const Selection& selection, const Fix& fix,
                         const Separation& separation, const Whereabouts& where,
                         Verdict& verdict) const noexcept {
  const Geometry& geometry = fix.geometry;
  const ChiSquaredTest& test = tables_.test(geometry.degrees());
  verdict.used = selection.size;
  verdict.along = fix.along;
  verdict.sigma = geometry.sigma();
  for (int k = 0; k < selection.size; ++k) {
    const auto c =
        static_cast<std::size_t>(satellites[selection.index[static_cast<std::size_t>(k)]].system);
    verdict.clock[c] = fix.clock[c];
  }
  const SnapshotIntegrity integrity = snapshot_integrity(geometry, settings_, tables_);
  for (int k = 0; k < selection.size; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const auto given = static_cast<std::size_t>(selection.index[i]);
    verdict.residual[given] = fix.residual[i];
    verdict.critical_bias[given] = integrity.critical_bias[i];
    verdict.missed[given] = integrity.missed[i];
  }
  verdict.p_star = integrity.p_star;
  const TangentError error(*track_, satellites, selection, fix, settings_.rotation);
  const TangentError::Bounds bounds = error.over(settings_.interval);
  verdict.bound = bounds.parity;
  verdict.bound_along = bounds.whole;
  const bool faults_matter = std::isfinite(integrity.noncentrality);
  verdict.e1 =
      faults_matter
          ? std::max(test.most_missed(integrity.noncentrality, verdict.bound) - integrity.p_star,
                     0.0)
          : 0.0;
  verdict.e2 = test.gain(0.0, verdict.bound);
  verdict.available = verdict.p_star <= settings_.missed;
  verdict.available_with_e1 = verdict.p_star + verdict.e1 <= settings_.missed;
  // What another place that passes has to say is not in any hypothesis: both are covered.
  verdict.rival = 0.0;
  if (std::isnan(where.near) || turns(where))
    verdict.rival =
        farthest_rival(*track_, satellites, selection, settings_, where, fix, test.threshold);
  verdict.snapshot_protection =
      verdict.rival + within(settings_.interval, [&](double half) {
        return snapshot_protection(geometry, integrity.slope, error.over(half), settings_, tables_);
      });
  verdict.protection = verdict.rival + separation.protection;
}

}  // namespace surefix::raim
