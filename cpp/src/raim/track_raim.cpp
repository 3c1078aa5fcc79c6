#include "surefix/raim/track_raim.hpp"

#include <algorithm>
#include <cmath>

namespace surefix::raim {
namespace {

constexpr double none = Verdict::none;

bool usable(const Satellite& s) noexcept {
  bool near = std::abs(s.pseudorange) <= farthest;  // false of NaN
  for (const double x : s.position) near = near && std::abs(x) <= farthest;
  const bool weighed = s.sigma >= smallest_sigma && s.sigma <= farthest;
  return near && weighed && s.system >= 0 && s.system < max_systems;
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
  const Search found = search(*track_, satellites, all, settings_, tables_, where);
  const Fix& first = found.fix;
  verdict.status = first.status;
  // A solution beyond K is as much of an alarm as a large residual: faults have moved it there.
  if (first.status == Solvable::off_track && first.geometry.size() > 0) {
    verdict.alarm = true;
    verdict.degrees = first.geometry.degrees();
    verdict.threshold = tables_.test(verdict.degrees).threshold;
    if (exclude(satellites, all, first, where, verdict)) verdict.status = Solvable::ok;
  }
  if (!first.ok()) return verdict;

  verdict.statistic = first.statistic;
  verdict.degrees = first.geometry.degrees();
  verdict.threshold = tables_.test(verdict.degrees).threshold;
  verdict.alarm = alarms(first);
  const Separation separation(first.geometry, first.residual.data(), settings_, tables_);
  verdict.separation_alarm = separation.alarm();
  verdict.declared = verdict.alarm || separation.alarm() ? Declared::alarm : Declared::ok;
  if (verdict.declared == Declared::alarm && exclude(satellites, all, first, where, verdict))
    return verdict;
  describe(satellites, all, found, separation, tables_.share(all.size, 0), verdict);
  return verdict;
}

bool TrackRaim::exclude(const Satellite* satellites, const Selection& all, const Fix& first,
                        const Whereabouts& where, Verdict& verdict) const noexcept {
  for (int size = 1; size <= settings_.max_excluded; ++size) {
    if (first.geometry.degrees() - size < 1) break;
    const SatelliteSet set = best_exclusion(first.geometry, first.residual.data(), size);
    if (set.size == 0) continue;
    const Selection rest = without_set(all, set);
    const double near = first.ok() ? first.along : none;
    const Search again =
        search(*track_, satellites, rest, settings_, tables_, {near, where.low, where.high});
    if (!again.fix.ok() || alarms(again.fix)) continue;
    const Separation separation(again.fix.geometry, again.fix.residual.data(), settings_, tables_);
    if (separation.alarm()) continue;
    verdict.declared = Declared::excluded;
    verdict.excluded = size;
    for (int k = 0; k < size; ++k) {
      const int member = set.member[static_cast<std::size_t>(k)];
      const int given = all.index[static_cast<std::size_t>(member)];
      verdict.taken_out[static_cast<std::size_t>(given)] = true;
    }
    describe(satellites, rest, again, separation, tables_.share(all.size, size), verdict);
    return true;
  }
  return false;
}

void TrackRaim::describe(const Satellite* satellites, const Selection& selection,
                         const Search& found, const Separation& separation, double share,
                         Verdict& verdict) const noexcept {
  const Fix& fix = found.fix;
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
  const TangentError error(*track_, satellites, selection, fix, settings_);
  verdict.p_star = integrity.p_star;
  verdict.bound = error.near().parity;
  verdict.bound_along = error.near().whole;
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
  verdict.rival = found.rival;
  verdict.snapshot_protection =
      verdict.rival + error.within([&](const TangentError::Bounds& bounds) {
        return snapshot_protection(geometry, integrity.slope, bounds, settings_, tables_);
      });
  if (settings_.max_faults > 0)
    verdict.protection = verdict.rival + separation.protection(error, share);
}

}  // namespace surefix::raim
