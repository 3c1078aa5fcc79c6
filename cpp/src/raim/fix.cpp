#include "surefix/raim/fix.hpp"

#include <algorithm>
#include <limits>

namespace surefix::raim {
namespace {

constexpr int most_steps = 50;
constexpr int most_halvings = 40;
constexpr double stride = 1000.0;  // [m]
constexpr double rounding = 1e-8;  // of S, sums of squares of differences of 2e7 m
constexpr double settled = 1e-6;   // [m]
constexpr int places = 257;        // along the track, when nothing is known of the position
constexpr int samples = 8;         // on each side of l̂

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
  /// y = (r − d(l))/σ, d'(l) and d''(l) of all satellites.
  void look_from(double l, Values& y, Values& slope, Values& second) const noexcept {
    const TrackPoint point = track.at(l);
    for (int k = 0; k < selection.size; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const Sight sight = look(point, satellite(k).position, rotation);
      y[i] = (satellite(k).pseudorange - sight.range) * clocks.root_weight(k);
      slope[i] = sight.slope;
      second[i] = sight.second;
    }
  }
  [[nodiscard]] double square(const Values& y) const noexcept {
    double sum = 0.0;
    for (int k = 0; k < selection.size; ++k)
      sum += y[static_cast<std::size_t>(k)] * y[static_cast<std::size_t>(k)];
    return sum;
  }
  /// S(l) = ‖y‖², clocks removed.
  [[nodiscard]] double left(double l) const noexcept {
    const TrackPoint point = track.at(l);
    Values y;
    for (int k = 0; k < selection.size; ++k) {
      const double range = look(point, satellite(k).position, rotation).range;
      y[static_cast<std::size_t>(k)] = (satellite(k).pseudorange - range) * clocks.root_weight(k);
    }
    clocks.remove(y.data());
    return square(y);
  }
  /// Where in [low, high] S is least.
  [[nodiscard]] double scan(double low, double high) const noexcept {
    double least = std::numeric_limits<double>::infinity(), best = low;
    for (int p = 0; p < places; ++p) {
      const double l = place(low, high, p), value = left(l);
      if (value < least) least = value, best = l;
    }
    return best;
  }
  [[nodiscard]] static double place(double low, double high, int p) noexcept {
    return low + (high - low) * p / (places - 1);
  }
  /// Σ r_i d_i''/σ_i: what the track's bend adds to S''/2 = G − it.
  [[nodiscard]] double bending(const Values& r, const Values& second) const noexcept {
    double sum = 0.0;
    for (int k = 0; k < selection.size; ++k) {
      const auto i = static_cast<std::size_t>(k);
      sum += r[i] * second[i] * clocks.root_weight(k);
    }
    return sum;
  }
};

}  // namespace

namespace {

struct Ends {
  double low, high;
};
/// K, on the track.
Ends ends(const Track& track, const MonitorSettings& settings, const Whereabouts& where) noexcept {
  return {std::max(where.low, track.low() - settings.interval),
          std::min(where.high, track.high() + settings.interval)};
}

}  // namespace

Fix find_fix(const Track& track, const Satellite* satellites, const Selection& selection,
             const MonitorSettings& settings, const Whereabouts& where) noexcept {
  Fix fix;
  Problem problem{track, satellites, selection, settings.rotation};
  for (int k = 0; k < selection.size; ++k)
    problem.clocks.add(1.0 / problem.satellite(k).sigma, problem.satellite(k).system);
  if (selection.size - 1 - problem.clocks.systems() < 1) return fix;

  const auto [low, high] = ends(track, settings, where);
  if (!(low < high)) {
    fix.status = Solvable::off_track;
    return fix;
  }
  double l = std::isnan(where.near) ? problem.scan(low, high) : where.near;
  double S = problem.left(l);
  Values y, slope, second;
  for (int step = 0; step < most_steps; ++step) {
    problem.look_from(l, y, slope, second);
    fix.geometry = Geometry(problem.clocks, slope.data());
    if (!fix.geometry.determined()) {
      fix.status = Solvable::geometry;
      return fix;
    }
    Values r = y;
    problem.clocks.remove(r.data());
    const double G = 1.0 / (fix.geometry.sigma() * fix.geometry.sigma());
    const double bent = problem.bending(r, second);
    double shift = fix.geometry.remove(r.data());
    fix.status = Solvable::diverged;
    if (std::abs(shift) <= settled) {
      const bool inside = low <= l && l <= high;
      fix.status = inside ? Solvable::ok : Solvable::off_track;
      fix.along = l;
      fix.residual = r;
      fix.statistic = problem.square(r);
      for (int c = 0; c < max_systems; ++c)
        fix.clock[static_cast<std::size_t>(c)] = problem.clocks.mean(c, y.data());
      return fix;
    }
    if (G > bent) shift *= G / (G - bent);
    shift = std::clamp(shift, -stride, stride);
    double next = problem.left(l + shift);
    const double enough = S + rounding * (1.0 + S);
    for (int half = 0; half < most_halvings && !(next <= enough); ++half) {
      shift *= 0.5;
      next = problem.left(l + shift);
    }
    if (!std::isfinite(next)) return fix;
    l += shift;
    S = next;
    const double beyond = std::max(low - l, l - high);
    if (beyond > stride) {
      fix.status = Solvable::off_track;
      fix.residual = r;
      return fix;
    }
  }
  return fix;
}

double farthest_rival(const Track& track, const Satellite* satellites, const Selection& selection,
                      const MonitorSettings& settings, const Whereabouts& where, const Fix& fix,
                      double threshold) noexcept {
  const auto [low, high] = ends(track, settings, where);
  const Problem problem{track, satellites, selection, settings.rotation, fix.geometry.clocks()};
  std::array<double, places> S;
  for (int p = 0; p < places; ++p)
    S[static_cast<std::size_t>(p)] = problem.left(Problem::place(low, high, p));
  double farthest = 0.0;
  for (int p = 0; p < places; ++p) {
    const auto k = static_cast<std::size_t>(p);
    const bool dips = (p == 0 || S[k] <= S[k - 1]) && (p == places - 1 || S[k] <= S[k + 1]);
    if (!dips) continue;
    const Fix other = find_fix(track, satellites, selection, settings,
                               {Problem::place(low, high, p), where.low, where.high});
    if (!other.ok() || other.statistic >= threshold) continue;
    farthest = std::max(farthest, std::abs(other.along - fix.along));
  }
  return farthest > 2.0 * settled ? farthest : 0.0;
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
