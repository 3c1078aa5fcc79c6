#include "surefix/raim/fix.hpp"

#include <algorithm>
#include <limits>

namespace surefix::raim {
namespace {

constexpr int most_steps = 30;
constexpr double settled = 1e-6;  // [m]
constexpr int places = 257;       // along the track, when nothing is known of the position
constexpr int samples = 8;        // on each side of l̂

using Values = std::array<double, max_satellites>;

/// Everything that find_fix looks at.
struct Problem {
  const Track& track;
  const Satellite* satellites;
  const Selection& selection;
  double rotation;
  Clocks clocks{};

  [[nodiscard]] const Satellite& satellite(int k) const noexcept {
    return satellites[selection.index[static_cast<std::size_t>(k)]];
  }
  /// y = (r − d(l))/σ and d'(l) of all satellites.
  void look_from(double l, Values& y, Values& slope) const noexcept {
    const TrackPoint point = track.at(l);
    for (int k = 0; k < selection.size; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const Sight sight = look(point, satellite(k).position, rotation);
      y[i] = (satellite(k).pseudorange - sight.range) * clocks.root_weight(k);
      slope[i] = sight.slope;
    }
  }
  [[nodiscard]] double square(const Values& y) const noexcept {
    double sum = 0.0;
    for (int k = 0; k < selection.size; ++k)
      sum += y[static_cast<std::size_t>(k)] * y[static_cast<std::size_t>(k)];
    return sum;
  }
  /// Where along the track the residual is least, clocks removed.
  [[nodiscard]] double scan() const noexcept {
    double least = std::numeric_limits<double>::infinity(), best = track.low();
    Values y, slope;
    for (int p = 0; p < places; ++p) {
      const double l = track.low() + (track.high() - track.low()) * p / (places - 1);
      look_from(l, y, slope);
      clocks.remove(y.data());
      const double value = square(y);
      if (value < least) least = value, best = l;
    }
    return best;
  }
};

}  // namespace

Fix find_fix(const Track& track, const Satellite* satellites, const Selection& selection,
             const MonitorSettings& settings, double near) noexcept {
  Fix fix;
  Problem problem{track, satellites, selection, settings.rotation};
  for (int k = 0; k < selection.size; ++k)
    problem.clocks.add(1.0 / problem.satellite(k).sigma, problem.satellite(k).system);
  if (selection.size - 1 - problem.clocks.systems() < 1) return fix;

  double l = std::isnan(near) ? problem.scan() : near;
  fix.status = Solvable::diverged;
  const double stride = std::max(track.high() - track.low(), 100.0);
  Values y, slope;
  for (int step = 0; step < most_steps; ++step) {
    problem.look_from(l, y, slope);
    fix.geometry = Geometry(problem.clocks, slope.data());
    if (!fix.geometry.determined()) {
      fix.status = Solvable::geometry;
      return fix;
    }
    Values r = y;
    const double shift = fix.geometry.remove(r.data());
    if (!std::isfinite(shift)) return fix;
    if (std::abs(shift) <= settled) {
      fix.status = Solvable::ok;
      fix.along = l;
      fix.residual = r;
      fix.statistic = problem.square(r);
      for (int c = 0; c < max_systems; ++c)
        fix.clock[static_cast<std::size_t>(c)] = problem.clocks.mean(c, y.data());
      break;
    }
    l = std::clamp(l + std::clamp(shift, -stride, stride), track.low() - stride,
                   track.high() + stride);
  }
  const bool outside = l < track.low() - settings.interval || l > track.high() + settings.interval;
  if (outside) fix.status = Solvable::off_track;
  return fix;
}

double linearisation_bound(const Track& track, const Satellite* satellites,
                           const Selection& selection, const Fix& fix, double half,
                           double rotation) noexcept {
  const Clocks& clocks = fix.geometry.clocks();
  const Problem problem{track, satellites, selection, rotation, clocks};
  const TrackPoint at = track.at(fix.along);
  const double bend = track.bend_bound(fix.along - half, fix.along + half);
  Values range, slope;
  double curved = 0.0;  // Σ (sup|d_i''|/σ_i)²
  for (int k = 0; k < selection.size; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Sight sight = look(at, problem.satellite(k).position, rotation);
    range[i] = sight.range;
    slope[i] = sight.slope;
    // The line of sight turns by 1e-7 rad/m: over the interval it is the same but for less than
    // itself; the Sagnac term bends by 1e-5 of the track's bend.
    const double second = (1.0 + 1e-5) * bend + 2.0 * sight.turning;
    curved += second * second * clocks.root_weight(k) * clocks.root_weight(k);
  }
  double most = 0.0;
  for (int p = -samples; p <= samples; ++p) {
    if (p == 0) continue;
    const double move = half * p / samples;
    const TrackPoint point = track.at(fix.along + move);
    Values error;
    for (int k = 0; k < selection.size; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double there = look(point, problem.satellite(k).position, rotation).range;
      error[i] = (there - range[i] - slope[i] * move) * clocks.root_weight(k);
    }
    static_cast<void>(fix.geometry.remove(error.data()));
    most = std::max(most, problem.square(error));
  }
  const double spacing = half / samples;
  return std::sqrt(most) + std::sqrt(curved) * spacing * spacing / 8.0;
}

}  // namespace surefix::raim
