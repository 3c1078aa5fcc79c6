#include "surefix/raim/track.hpp"

#include <gtest/gtest.h>

#include "raim/epochs.hpp"

namespace surefix::raim {
namespace {

using test::Random;

double norm(const Point& a) { return std::sqrt(dot(a, a)); }

TEST(Track, PassesThroughItsVertices) {
  Random random(1);
  Eigen::MatrixXd points(40, 3);
  for (int i = 0; i < 40; ++i)
    points.row(i) << 10.0 * i, 5.0 * random.normal(), 0.1 * random.normal();
  Track track;
  ASSERT_EQ(Track::make(points, 0.0, 100.0, track), ConfigStatus::ok);
  EXPECT_EQ(track.low(), 100.0);
  double l = 100.0;
  for (int i = 0; i < 40; ++i) {
    if (i > 0) l += (points.row(i) - points.row(i - 1)).norm();
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR(track.at(l).position[static_cast<std::size_t>(j)], points(i, j), 1e-10);
  }
  EXPECT_EQ(track.error(), 0.0);
}

TEST(Track, DerivativesAreThoseOfThePosition) {
  const Track track = testing::arc();
  for (double l = -320.0; l < 330.0; l += 13.7) {
    const double h = 1e-3;
    const TrackPoint at = track.at(l), before = track.at(l - h), after = track.at(l + h);
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_NEAR(at.tangent[j], (after.position[j] - before.position[j]) / (2 * h), 1e-8);
      EXPECT_NEAR(at.bend[j], (after.tangent[j] - before.tangent[j]) / (2 * h), 1e-8);
    }
    EXPECT_LE(norm(at.bend), track.bend_bound(l, l) * (1 + 1e-12));
  }
  EXPECT_EQ(norm(track.at(400.0).bend), 0.0);  // straight beyond its ends
}

TEST(Track, SmoothsWithinItsTolerance) {
  Random random(2);
  Eigen::MatrixXd points(300, 3);
  for (int i = 0; i < 300; ++i) {
    const double l = 2.0 * i;
    points.row(i) << 500.0 * std::sin(l / 500.0), 500.0 * (1 - std::cos(l / 500.0)), 0.0;
    for (int j = 0; j < 3; ++j) points(i, j) += 0.03 * random.normal();
  }
  Track rough, smooth;
  ASSERT_EQ(Track::make(points, 0.0, 0.0, rough), ConfigStatus::ok);
  ASSERT_EQ(Track::make(points, 0.15, 0.0, smooth), ConfigStatus::ok);
  EXPECT_LE(smooth.error(), 0.15);
  EXPECT_GT(smooth.error(), 0.1);  // no stiffer than it may be, no softer than it must
  EXPECT_GE(smooth.edge_error(), smooth.error());
  EXPECT_GT(rough.bend_bound(100.0, 500.0), 0.03);
  EXPECT_NEAR(smooth.bend_bound(100.0, 500.0), 1.0 / 500.0, 0.001);
  EXPECT_GE(smooth.curvature_bound(100.0, 500.0), 0.9 / 500.0);
}

TEST(Track, FindsTheNearestPoint) {
  const Track track = testing::arc();
  Random random(3);
  for (int k = 0; k < 200; ++k) {
    const double l = 290.0 * std::sin(1.0 * k), off = 20.0 * random.normal();
    const TrackPoint at = track.at(l);
    const Point normal{-at.tangent[1], at.tangent[0], 0.0};
    const double length = norm(normal);
    Point place = at.position;
    for (std::size_t j = 0; j < 3; ++j) place[j] += off * normal[j] / length;
    EXPECT_NEAR(track.nearest(place), l, 1e-6);
  }
}

TEST(Track, RefusesWhatIsNone) {
  Track track;
  EXPECT_EQ(Track::make(Eigen::MatrixXd::Zero(1, 3), 0.0, 0.0, track), ConfigStatus::wrong_size);
  EXPECT_EQ(Track::make(Eigen::MatrixXd::Zero(2, 3), 0.0, 0.0, track), ConfigStatus::not_positive);
  Eigen::MatrixXd points(2, 3);
  points << 0, 0, 0, 1, 0, 0;
  EXPECT_EQ(Track::make(points, -1.0, 0.0, track), ConfigStatus::negative);
  EXPECT_EQ(Track::make(points, std::nan(""), 0.0, track), ConfigStatus::not_finite);
  EXPECT_EQ(Track::make(points, 0.0, 0.0, track), ConfigStatus::ok);
  EXPECT_NEAR(track.at(0.5).position[0], 0.5, 1e-15);
}

}  // namespace
}  // namespace surefix::raim
