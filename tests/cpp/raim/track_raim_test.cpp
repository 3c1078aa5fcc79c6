#include "surefix/raim/track_raim.hpp"

#include <gtest/gtest.h>

#include "raim/epochs.hpp"
#include "surefix/raim/follower.hpp"

namespace surefix::raim {
namespace {

using testing::arc;
using testing::epoch;
using testing::Random;
constexpr Whereabouts anywhere{};

/// Weighted least squares the plain way: normal equations of (l, clocks) solved by elimination.
struct Plain {
  double along = 0.0, variance = 0.0, statistic = 0.0;
};
Plain plain(const Track& track, const std::vector<Satellite>& satellites, double l, int systems) {
  Plain out;
  const auto m = static_cast<std::size_t>(1 + systems);
  for (int step = 0; step < 20; ++step) {
    std::vector<std::vector<double>> A(m, std::vector<double>(m + 2, 0.0));
    for (std::size_t i = 0; i < m; ++i) A[i][m + 1] = i == 0 ? 1.0 : 0.0;
    const TrackPoint here = track.at(l);
    for (const Satellite& s : satellites) {
      const Sight sight = look(here, s.position, 0.0);
      std::vector<double> row(m, 0.0);
      row[0] = sight.slope;
      row[static_cast<std::size_t>(1 + s.system)] = 1.0;
      const double w = 1.0 / (s.sigma * s.sigma), y = s.pseudorange - sight.range;
      for (std::size_t i = 0; i < m; ++i) {
        for (std::size_t j = 0; j < m; ++j) A[i][j] += w * row[i] * row[j];
        A[i][m] += w * row[i] * y;
      }
    }
    for (std::size_t p = 0; p < m; ++p)  // Gauss–Jordan, two right-hand sides
      for (std::size_t i = 0; i < m; ++i) {
        if (i == p) continue;
        const double f = A[i][p] / A[p][p];
        for (std::size_t j = p; j < m + 2; ++j) A[i][j] -= f * A[p][j];
      }
    out.variance = A[0][m + 1] / A[0][0];
    l += A[0][m] / A[0][0];
    out.along = l;
    out.statistic = 0.0;
    const TrackPoint after = track.at(l);
    for (const Satellite& s : satellites) {
      const double clock =
          A[static_cast<std::size_t>(1 + s.system)][m] /
          A[static_cast<std::size_t>(1 + s.system)][static_cast<std::size_t>(1 + s.system)];
      const double r = (s.pseudorange - look(after, s.position, 0.0).range - clock) / s.sigma;
      out.statistic += r * r;
    }
  }
  return out;
}

TEST(TrackRaim, SolvesAsPlainLeastSquaresDoes) {
  const Track track = arc();
  Random random(1);
  for (int systems = 1; systems <= 3; ++systems) {
    const TrackRaim monitor(track, {});
    const auto satellites = epoch(track, 37.0, 10, systems, random);
    const Verdict verdict = monitor.judge(satellites.data(), 10, anywhere);
    ASSERT_EQ(verdict.status, Solvable::ok);
    const Plain expected = plain(track, satellites, 0.0, systems);
    EXPECT_NEAR(verdict.along, expected.along, 1e-5);
    EXPECT_NEAR(verdict.sigma, std::sqrt(expected.variance), 1e-6 * verdict.sigma);
    EXPECT_NEAR(verdict.statistic, expected.statistic, 1e-5);
    EXPECT_EQ(verdict.degrees, 10 - 1 - systems);
    EXPECT_NEAR(verdict.clock[0], 1000.0, 40.0);
  }
}

TEST(TrackRaim, FindsAndTakesOutFaultySatellites) {
  const Track track = arc();
  Random random(2);
  MonitorSettings settings;
  settings.max_excluded = 3;
  const TrackRaim monitor(track, settings);
  for (int faulty = 0; faulty <= 3; ++faulty) {
    auto satellites = epoch(track, -120.0, 12, 2, random, 0.5);
    const int which[] = {1, 6, 8};
    for (int k = 0; k < faulty; ++k)
      satellites[static_cast<std::size_t>(which[k])].pseudorange += 150.0 + 120.0 * k;
    const Verdict verdict = monitor.judge(satellites.data(), 12, anywhere);
    EXPECT_EQ(verdict.declared, faulty == 0 ? Declared::ok : Declared::excluded);
    EXPECT_EQ(verdict.excluded, faulty);
    EXPECT_EQ(verdict.used, 12 - faulty);
    for (int k = 0; k < faulty; ++k)
      EXPECT_TRUE(verdict.taken_out[static_cast<std::size_t>(which[k])]);
    EXPECT_NEAR(verdict.along, -120.0, 5.0 * verdict.sigma);
    EXPECT_LT(verdict.protection, 1000.0);
  }
}

TEST(TrackRaim, TakesOutAFaultThatLeavesTheTrack) {
  const Track track = arc();
  Random random(8);
  const TrackRaim monitor(track, {});
  auto satellites = epoch(track, 100.0, 10, 1, random, 0.5);
  satellites[4].pseudorange += 30000.0;
  const Verdict verdict = monitor.judge(satellites.data(), 10, anywhere);
  EXPECT_EQ(verdict.status, Solvable::ok);
  EXPECT_EQ(verdict.declared, Declared::excluded);
  EXPECT_TRUE(verdict.alarm);
  EXPECT_TRUE(verdict.taken_out[4]);
  EXPECT_NEAR(verdict.along, 100.0, 5.0 * verdict.sigma);

  MonitorSettings settings;
  settings.max_excluded = 0;
  const Verdict lost = TrackRaim(track, settings).judge(satellites.data(), 10, anywhere);
  EXPECT_EQ(lost.status, Solvable::off_track);
  EXPECT_EQ(lost.declared, Declared::not_available);
}

TEST(TrackRaim, SeparationIsTheSolutionWithoutTheSatellites) {
  Eigen::MatrixXd ends(2, 3);
  ends << -300.0, 40.0, 0.0, 300.0, -20.0, 5.0;
  Track track;  // straight: a set's solution is linear, the plain one iterated
  ASSERT_EQ(Track::make(ends, 0.0, -300.0, track), ConfigStatus::ok);
  Random random(3);
  const auto satellites = epoch(track, 10.0, 9, 2, random);
  Selection all;
  for (int i = 0; i < 9; ++i) all.index[static_cast<std::size_t>(all.size++)] = i;
  const Fix fix = find_fix(track, satellites.data(), all, {}, anywhere);
  ASSERT_TRUE(fix.ok());
  for (int i = 0; i < 9; ++i)
    for (int j = i + 1; j < 9; ++j) {
      const SetSolution set = without(fix.geometry, fix.residual.data(), i, j);
      std::vector<Satellite> rest;
      for (int k = 0; k < 9; ++k)
        if (k != i && k != j) rest.push_back(satellites[static_cast<std::size_t>(k)]);
      const Plain expected = plain(track, rest, fix.along, 2);
      EXPECT_NEAR(set.shift, expected.along - fix.along, 1e-4);
      EXPECT_NEAR(set.variance + fix.geometry.sigma() * fix.geometry.sigma(), expected.variance,
                  1e-5 * expected.variance);
    }
}

TEST(TrackRaim, SaysWhyThereIsNoAnswer) {
  const Track track = arc();
  Random random(4);
  const TrackRaim monitor(track, {});
  auto satellites = epoch(track, 0.0, 10, 1, random);
  EXPECT_EQ(monitor.judge(satellites.data(), 0, anywhere).status, Solvable::too_few);
  EXPECT_EQ(monitor.judge(satellites.data(), 2, anywhere).status, Solvable::too_few);
  EXPECT_EQ(monitor.judge(satellites.data(), 3, anywhere).status, Solvable::ok);

  auto same = satellites;
  for (Satellite& s : same) s.position = satellites[0].position;
  EXPECT_EQ(monitor.judge(same.data(), 10, anywhere).status, Solvable::geometry);

  auto bad = satellites;
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  bad[0].pseudorange = nan;
  bad[1].sigma = infinity;
  bad[2].position[1] = -infinity;
  bad[3].system = max_systems;
  bad[4].sigma = 0.0;
  bad[5].system = -1;
  const Verdict rest = monitor.judge(bad.data(), 10, anywhere);
  EXPECT_EQ(rest.status, Solvable::ok);
  EXPECT_EQ(rest.used, 4);
  EXPECT_TRUE(std::isnan(rest.residual[0]));

  std::vector<Satellite> many(max_satellites + 1, satellites[0]);
  const Verdict too_many = monitor.judge(many.data(), max_satellites + 1, anywhere);
  EXPECT_EQ(too_many.status, Solvable::too_many);
  EXPECT_EQ(too_many.declared, Declared::not_available);
  EXPECT_TRUE(std::isnan(too_many.along));

  const TrackPoint far = track.at(900.0);
  for (Satellite& s : satellites) s.pseudorange = look(far, s.position, 0.0).range;
  EXPECT_EQ(monitor.judge(satellites.data(), 10, anywhere).status, Solvable::off_track);
}

TEST(TrackRaim, ASystemWithOneSatelliteChangesNothing) {
  const Track track = arc();
  Random random(5);
  auto satellites = epoch(track, 55.0, 9, 1, random);
  const TrackRaim monitor(track, {});
  const Verdict before = monitor.judge(satellites.data(), 8, anywhere);
  satellites[8].system = 3;
  const Verdict after = monitor.judge(satellites.data(), 9, anywhere);
  EXPECT_NEAR(after.along, before.along, 1e-5);
  EXPECT_EQ(after.degrees, before.degrees);
  EXPECT_EQ(after.critical_bias[8], std::numeric_limits<double>::infinity());
  // One hypothesis more of no consequence, and more sets of satellites that may be faulty at once.
  EXPECT_NEAR(after.protection, before.protection, 0.02 * before.protection);
}

TEST(TrackRaim, WhereTheIterationBeginsChangesNothing) {
  const Track track = arc();
  Random random(6);
  const TrackRaim monitor(track, {});
  const auto satellites = epoch(track, 210.0, 10, 2, random);
  const Verdict a = monitor.judge(satellites.data(), 10, anywhere);
  for (const double near : {-250.0, 0.0, 210.0}) {
    const Verdict b = monitor.judge(satellites.data(), 10, {near});
    EXPECT_NEAR(a.along, b.along, 1e-5);
    EXPECT_NEAR(a.statistic, b.statistic, 1e-5);
  }
}

TEST(Follower, LooksWhereTheVehicleCanBe) {
  const Track track = arc();
  Random random(7);
  const TrackRaim monitor(track, {});
  Follower follower(monitor, 20.0, anywhere.near);
  const auto at = [&](double time, double l) {
    const auto satellites = epoch(track, l, 10, 2, random, 0.3);
    return follower.judge(time, satellites.data(), 10);
  };
  EXPECT_EQ(at(0.0, -200.0).declared, Declared::ok);
  EXPECT_NEAR(follower.place(), -200.0, 20.0);
  EXPECT_EQ(at(1.0, -190.0).declared, Declared::ok);
  // 300 m in a second: beyond 20 m/s and L. What was last known stays.
  const Verdict jump = at(2.0, 110.0);
  EXPECT_EQ(jump.status, Solvable::off_track);
  EXPECT_TRUE(std::isnan(jump.along));
  EXPECT_NEAR(follower.place(), -190.0, 20.0);
  EXPECT_LT(follower.low(), -190.0);
  EXPECT_GT(follower.high(), -190.0);
  EXPECT_EQ(at(20.0, 110.0).declared, Declared::ok);  // in 19 s it can be there
}

TEST(TrackRaim, RefusesSettingsThatPromiseNothing) {
  const auto refused = [](auto&& change) {
    MonitorSettings settings;
    change(settings);
    return settings.check();
  };
  EXPECT_EQ(refused([](MonitorSettings&) {}), ConfigStatus::ok);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.length = 0.0; }), ConfigStatus::not_positive);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.interval = 0.0; }), ConfigStatus::not_positive);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.length = std::nan(""); }), ConfigStatus::not_finite);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.interval = std::nan(""); }),
            ConfigStatus::not_finite);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.rotation = std::nan(""); }),
            ConfigStatus::not_finite);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.false_alarm = 0.0; }), ConfigStatus::prior);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.missed = 1.0; }), ConfigStatus::prior);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.fault_probability = std::nan(""); }),
            ConfigStatus::prior);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.risk = 1.0; }), ConfigStatus::risk);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.max_faults = 3; }), ConfigStatus::wrong_size);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.max_faults = -1; }), ConfigStatus::wrong_size);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.max_excluded = -1; }), ConfigStatus::wrong_size);
  EXPECT_EQ(refused([](MonitorSettings& s) { s.max_excluded = 5; }), ConfigStatus::wrong_size);
}

TEST(TrackRaim, KBesideTheTrackHoldsNothing) {
  const Track track = arc();
  Random random(9);
  const TrackRaim monitor(track, {});
  const auto satellites = epoch(track, 0.0, 10, 1, random);
  Whereabouts where;
  where.low = 1000.0;
  where.high = 2000.0;
  const Verdict verdict = monitor.judge(satellites.data(), 10, where);
  EXPECT_EQ(verdict.status, Solvable::off_track);
  EXPECT_EQ(verdict.declared, Declared::not_available);
  EXPECT_FALSE(verdict.alarm);  // nothing was looked for
  EXPECT_TRUE(std::isnan(verdict.along));
}

TEST(TrackRaim, AFaultThatNoResidualShowsHasNoProtection) {
  // All but one in one direction: that one alone gives the position.
  const Track track = arc();
  Random random(10);
  auto satellites = epoch(track, 20.0, 8, 1, random);
  for (std::size_t i = 1; i < 8; ++i) {
    satellites[i].position = satellites[1].position;
    satellites[i].pseudorange = satellites[1].pseudorange + 0.5 * random.normal();
  }
  const TrackRaim monitor(track, {});
  const Verdict verdict = monitor.judge(satellites.data(), 8, {0.0});
  ASSERT_EQ(verdict.status, Solvable::ok);
  EXPECT_EQ(verdict.declared, Declared::ok);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(verdict.protection, infinity);
  EXPECT_EQ(verdict.snapshot_protection, infinity);
  EXPECT_LT(verdict.critical_bias[0], infinity);
  EXPECT_NEAR(verdict.missed[0], 1.0 - 1e-5, 1e-9);  // seen by chance only
  EXPECT_FALSE(verdict.available);
}

TEST(Follower, AJumpPastTheIntervalBeginsANewOne) {
  Eigen::MatrixXd ends(2, 3);
  ends << -3000.0, 0.0, 0.0, 3000.0, 0.0, 0.0;
  Track track;
  ASSERT_EQ(Track::make(ends, 0.0, -3000.0, track), ConfigStatus::ok);
  const TrackRaim monitor(track, {});
  for (const double sign : {-1.0, 1.0}) {
    Random random(11);
    Follower follower(monitor, 0.0, anywhere.near);
    const auto at = [&](double time, double l, double worse) {
      auto satellites = epoch(track, l, 10, 1, random, 0.0);
      for (Satellite& s : satellites) s.sigma *= worse;
      return follower.judge(time, satellites.data(), 10);
    };
    const Verdict coarse = at(0.0, 0.0, 20.0);
    ASSERT_EQ(coarse.declared, Declared::ok);
    ASSERT_GT(coarse.protection, 500.0);
    ASSERT_NEAR(follower.high(), coarse.protection, 1.0);
    // It stands still, and is where a position that is off twice could be, but not once.
    const double far = sign * 1.5 * coarse.protection;
    const Verdict fine = at(1.0, far, 1.0);
    ASSERT_EQ(fine.declared, Declared::ok);
    ASSERT_LT(fine.protection, 0.4 * coarse.protection);
    const double off = std::max(50.0, fine.protection);
    EXPECT_NEAR(follower.low(), far - off, 1.0);
    EXPECT_NEAR(follower.high(), far + off, 1.0);
    EXPECT_NEAR(follower.place(), far, 1.0);
  }
}

TEST(Follower, RefusesAndCountsATimeThatIsNoneOrRunsBackwards) {
  const Track track = arc();
  const TrackRaim monitor(track, {});
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  for (const double none : {nan, infinity, -infinity, -0.1, -1e300}) {
    Random random(7);
    Follower with(monitor, 20.0, -200.0), without = with;
    const auto first = epoch(track, -200.0, 10, 2, random, 0.3);
    for (Follower* follower : {&with, &without})
      ASSERT_EQ(follower->judge(0.0, first.data(), 10).declared, Declared::ok);
    const double low = with.low(), high = with.high(), place = with.place();
    // Satellites that would be a position, if it were known when.
    const Verdict refused = with.judge(none, first.data(), 10);
    EXPECT_EQ(refused.declared, Declared::not_available);
    EXPECT_EQ(refused.status, Solvable::time);
    EXPECT_TRUE(std::isnan(refused.along) && std::isnan(refused.protection));
    EXPECT_FALSE(refused.alarm || refused.available);
    EXPECT_EQ(with.refused(), 1);
    EXPECT_EQ(with.low(), low);
    EXPECT_EQ(with.high(), high);
    EXPECT_EQ(with.place(), place);
    // 10 s after the first, by 20 m/s as far as if the other had not been.
    EXPECT_EQ(with.judge(10.0, nullptr, 0).status, Solvable::too_few);
    EXPECT_EQ(without.judge(10.0, nullptr, 0).status, Solvable::too_few);
    EXPECT_EQ(with.low(), low - 200.0);
    EXPECT_EQ(with.high(), high + 200.0);
    EXPECT_EQ(with.low(), without.low());
    // And a vehicle that has moved for 19 s is found, a second time at the same time as well.
    const auto moved = epoch(track, 110.0, 10, 2, random, 0.3);
    for (int again = 0; again < 2; ++again) {
      EXPECT_EQ(with.judge(19.0, moved.data(), 10).declared, Declared::ok);
      EXPECT_NEAR(with.place(), 110.0, 20.0);
    }
    EXPECT_EQ(with.refused(), 1);
    EXPECT_EQ(without.refused(), 0);
  }
}

TEST(Follower, RefusesTheFirstTimeTooIfItIsNone) {
  const Track track = arc();
  const TrackRaim monitor(track, {});
  Follower follower(monitor, 20.0, -200.0);
  Random random(7);
  const auto first = epoch(track, -200.0, 10, 2, random, 0.3);
  EXPECT_EQ(follower.judge(std::nan(""), first.data(), 10).status, Solvable::time);
  EXPECT_EQ(follower.judge(-5.0, first.data(), 10).declared, Declared::ok);
}

}  // namespace
}  // namespace surefix::raim
