#include "surefix/raim/fix.hpp"

#include <algorithm>

#include "epoch_problem.hpp"

namespace surefix::raim {
namespace {

constexpr int most_steps = 50;
constexpr int most_halvings = 40;
constexpr double lost = 1000.0;    // beyond an end: it does not come back [m]
constexpr double rounding = 1e-8;  // of S, sums of squares of differences of 2e7 m

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
    shift = std::clamp(shift, -where.step, where.step);
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
    if (beyond > lost) {
      fix.status = Solvable::off_track;
      fix.residual = r;
      return fix;
    }
  }
  return fix;
}

}  // namespace surefix::raim
