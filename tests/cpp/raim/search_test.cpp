#include "surefix/raim/search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "raim/epochs.hpp"

namespace surefix::raim {
namespace {

using testing::epoch;
using testing::Random;

/// A line of `pieces` of 10 m that turns at random by some of `sharpness` radians at every vertex,
/// and comes near to itself.
Track winding(int pieces, double sharpness, Random& random) {
  Eigen::MatrixXd points = Eigen::MatrixXd::Zero(pieces + 1, 3);
  double heading = 0.0;
  for (int i = 1; i <= pieces; ++i) {
    heading += sharpness * random.normal();
    points.row(i) = points.row(i - 1);
    points(i, 0) += 10.0 * std::cos(heading);
    points(i, 1) += 10.0 * std::sin(heading);
  }
  Track track;
  static_cast<void>(Track::make(points, 0.0, 0.0, track));
  return track;
}

/// S(l) from its definition: weighted squares about each system's weighted mean.
double left(const Track& track, const std::vector<Satellite>& satellites, double l) {
  const TrackPoint here = track.at(l);
  double S = 0.0;
  for (int c = 0; c < 2; ++c) {
    double weight = 0.0, mean = 0.0, squares = 0.0;
    for (const int pass : {0, 1})
      for (const Satellite& s : satellites) {
        if (s.system != c) continue;
        const double w = 1.0 / (s.sigma * s.sigma);
        const double y = s.pseudorange - look(here, s.position, 0.0).range;
        if (pass == 0) weight += w, mean += w * y;
        if (pass == 1) squares += w * (y - mean / weight) * (y - mean / weight);
      }
    S += squares;
  }
  return S;
}

struct Minimum {
  double l, root;
};
/// Minima of √S below `level`, each with a ridge of more than `ridge` between it and the next.
std::vector<Minimum> minima(const Track& track, const std::vector<Satellite>& satellites,
                            double level, double ridge) {
  constexpr double step = 0.1;
  std::vector<Minimum> out;
  double highest = std::numeric_limits<double>::infinity();  // since the last one
  double before = highest, here = highest;
  for (double l = track.low() - 25.0; l < track.high() + 25.0 + 1.5 * step; l += step) {
    const double next = l < track.high() + 25.0 + 0.5 * step
                            ? std::sqrt(left(track, satellites, l))
                            : std::numeric_limits<double>::infinity();
    if (here < level && here < before && here <= next) {
      const Minimum found{l - step, here};
      if (out.empty() || highest - std::max(here, out.back().root) > ridge)
        out.push_back(found);
      else if (here < out.back().root)
        out.back() = found;
      highest = here;
    }
    before = here;
    here = next;
    highest = std::max(highest, here);
  }
  return out;
}
double farthest(const std::vector<Minimum>& minima, double l) {
  double far = 0.0;
  for (const Minimum& other : minima) far = std::max(far, std::abs(other.l - l));
  return far;
}

TEST(Search, FindsEveryPlaceThatPasses) {
  const MonitorSettings settings;
  const MonitorTables tables(settings);
  Random random(11);
  int rivals = 0;
  for (int round = 0; round < 60; ++round) {
    const Track track = winding(150, 0.5, random);
    auto satellites = epoch(track, 100.0 + 12.0 * round, 9, 2, random, 0.0);
    for (Satellite& s : satellites) {  // as wide as the line's loops
      s.sigma *= 4.0;
      s.pseudorange += s.sigma * random.normal();
    }
    Selection all;
    for (int i = 0; i < 9; ++i) all.index[static_cast<std::size_t>(all.size++)] = i;
    const double near = round % 2 == 0 ? 500.0 : std::numeric_limits<double>::quiet_NaN();
    const Search found = search(track, satellites.data(), all, settings, tables, {near});

    const double root = std::sqrt(tables.test(6).threshold);
    const auto all_minima = minima(track, satellites, root, 0.0);
    const auto apart = minima(track, satellites, root, root / 12.0);
    if (all_minima.empty()) {
      EXPECT_FALSE(found.fix.ok() && found.fix.statistic < root * root);
      continue;
    }
    const auto least = std::min_element(all_minima.begin(), all_minima.end(),
                                        [](auto& a, auto& b) { return a.root < b.root; });
    ASSERT_TRUE(found.fix.ok()) << round;
    EXPECT_NEAR(found.fix.along, least->l, 0.2) << round;
    EXPECT_GE(found.rival, farthest(apart, least->l) - 0.4) << round;
    EXPECT_LE(found.rival, farthest(all_minima, least->l) + 0.4) << round;
    if (farthest(apart, least->l) > 0.2) ++rivals;
  }
  EXPECT_GT(rivals, 15);
}

TEST(Search, SaysSoWhereKIsTooLongToBeLookedThrough) {
  // Satellites so near to one direction that 10,000 km of track are as good as any: the line turns
  // no sight, and nothing falls.
  Eigen::MatrixXd ends(2, 3);
  ends << 0.0, 0.0, 0.0, 1e7, 0.0, 0.0;
  Track track;
  ASSERT_EQ(Track::make(ends, 0.0, 0.0, track), ConfigStatus::ok);
  const MonitorSettings settings;
  const MonitorTables tables(settings);
  std::vector<Satellite> satellites;
  Selection all;
  for (int i = 0; i < 6; ++i) {
    Satellite s;
    s.position = {5e6, 1e13 + 1e9 * i, 3e9 * i * i};
    s.sigma = 1e-3;
    s.system = 0;
    s.pseudorange = look(track.at(4e6), s.position, 0.0).range;
    satellites.push_back(s);
    all.index[static_cast<std::size_t>(all.size++)] = i;
  }
  const Search found = search(track, satellites.data(), all, settings, tables, {4e6});
  EXPECT_EQ(found.rival, std::numeric_limits<double>::infinity());
}

TEST(Sight, GradientIsThatOfTheRange) {
  const Point at{1000.0, -2000.0, 6.3e6}, satellite{1.5e7, 1.1e7, 1.8e7};
  const Point gradient = raim::gradient(at, satellite, earth_rotation);
  for (std::size_t j = 0; j < 3; ++j) {
    Point before = at, after = at;
    before[j] -= 50.0;
    after[j] += 50.0;
    const double numeric = (look({after, {}, {}}, satellite, earth_rotation).range -
                            look({before, {}, {}}, satellite, earth_rotation).range) /
                           100.0;
    EXPECT_NEAR(gradient[j], numeric, 1e-9);
  }
}

TEST(Search, FindsThePlaceThatTheFirstIterationDoesNotReach) {
  const Track track = testing::arc();
  const MonitorSettings settings;
  const MonitorTables tables(settings);
  Random random(12);
  const auto satellites = epoch(track, 200.0, 9, 2, random, 0.3);
  Selection all;
  for (int i = 0; i < 9; ++i) all.index[static_cast<std::size_t>(all.size++)] = i;
  Whereabouts where;
  where.near = -200.0;
  where.step = 1.0;  // 50 of them
  const Fix short_of_it = find_fix(track, satellites.data(), all, settings, where);
  EXPECT_EQ(short_of_it.status, Solvable::diverged);
  const Search found = search(track, satellites.data(), all, settings, tables, where);
  ASSERT_EQ(found.fix.status, Solvable::ok);
  EXPECT_NEAR(found.fix.along, 200.0, 5.0 * found.fix.geometry.sigma());
  EXPECT_EQ(found.rival, 0.0);
}

TEST(FindFix, NumbersThatAreNoneDiverge) {
  const Track track = testing::arc();
  Random random(13);
  Selection all;
  for (int i = 0; i < 9; ++i) all.index[static_cast<std::size_t>(all.size++)] = i;
  for (const double bad : {std::nan(""), 1e200}) {  // whose square overflows
    auto satellites = epoch(track, 50.0, 9, 2, random);
    satellites[3].pseudorange = bad;
    const Fix fix = find_fix(track, satellites.data(), all, {}, {0.0});
    EXPECT_EQ(fix.status, Solvable::diverged) << bad;
  }
}

}  // namespace
}  // namespace surefix::raim
