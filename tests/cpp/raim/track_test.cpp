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

TEST(Track, RefusesWhatIsNoneOverMileagesOfTheCallers) {
  Track track;
  Eigen::MatrixXd points(3, 3), infinite, missing;
  points << 0, 0, 0, 1, 0, 0, 2, 0, 0;
  infinite = missing = points;
  infinite(1, 2) = std::numeric_limits<double>::infinity();
  missing(0, 0) = std::nan("");
  Eigen::VectorXd mileage = Eigen::Vector3d(5, 6, 8);
  ASSERT_EQ(Track::make(points, mileage, 0.0, track), ConfigStatus::ok);
  const auto made = [&](const Eigen::MatrixXd& p, const Eigen::VectorXd& l) {
    return Track::make(p, l, 0.0, track);
  };
  EXPECT_EQ(made(points.topRows(1), mileage.head(1)), ConfigStatus::wrong_size);
  EXPECT_EQ(made(points.leftCols(2), mileage), ConfigStatus::wrong_size);
  EXPECT_EQ(made(points, mileage.head(2)), ConfigStatus::wrong_size);
  EXPECT_EQ(Track::make(points.leftCols(2), 0.0, 0.0, track), ConfigStatus::wrong_size);
  EXPECT_EQ(made(infinite, mileage), ConfigStatus::not_finite);
  EXPECT_EQ(Track::make(missing, 0.0, 0.0, track), ConfigStatus::not_finite);
  EXPECT_EQ(Track::make(points, 0.0, std::nan(""), track), ConfigStatus::not_finite);
  mileage(1) = std::nan("");
  EXPECT_EQ(made(points, mileage), ConfigStatus::not_finite);
  mileage(1) = 8.0;
  EXPECT_EQ(made(points, mileage), ConfigStatus::not_positive);
  EXPECT_EQ(track.low(), 5.0);  // and stays as it was
  EXPECT_EQ(track.high(), 8.0);
}

TEST(Track, ToleranceThatChangesNothing) {
  // Two points have nothing to be smoothed.
  Eigen::MatrixXd points(2, 3);
  points << 0, 0, 0, 3, 4, 0;
  Track track;
  ASSERT_EQ(Track::make(points, 1.0, 0.0, track), ConfigStatus::ok);
  EXPECT_EQ(track.error(), 0.0);
  EXPECT_NEAR(track.at(2.5).position[1], 2.0, 1e-15);
  // A tolerance below all that can be smoothed: the curve through the vertices.
  Random random(6);
  Eigen::MatrixXd rough = Eigen::MatrixXd::Zero(60, 3);
  for (int i = 0; i < 60; ++i) {
    rough(i, 0) = 10.0 * i;
    if (i % 3 != 0) rough(i, 1) = 5.0 * random.normal();
  }
  Track exact;
  ASSERT_EQ(Track::make(rough, 0.0, 0.0, exact), ConfigStatus::ok);
  ASSERT_EQ(Track::make(rough, 1e-40, 0.0, track), ConfigStatus::ok);
  EXPECT_EQ(track.error(), 0.0);
  for (const double l : {3.0, 77.0, 300.0}) EXPECT_EQ(track.at(l).bend, exact.at(l).bend);
}

TEST(Track, AHairpinHasNoBoundOnItsCurvature) {
  Eigen::MatrixXd points(5, 3);
  points << 0, 0, 0, 10, 0, 0, 20, 0, 0, 10, 0.01, 0, 0, 0.01, 0;
  Track track;
  ASSERT_EQ(Track::make(points, 0.0, 0.0, track), ConfigStatus::ok);
  EXPECT_EQ(track.curvature_bound(0.0, 40.0), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isfinite(track.bend_bound(0.0, 40.0)));
}

TEST(Track, AVertexMayStandStill) {
  // Mileages of the caller's go on where the line does not.
  Eigen::MatrixXd points(4, 3);
  points << 0, 0, 0, 10, 0, 0, 10, 0, 0, 20, 0, 0;
  const Eigen::VectorXd mileage = Eigen::Vector4d(0, 10, 15, 25);
  Track track;
  ASSERT_EQ(Track::make(points, mileage, 0.0, track), ConfigStatus::ok);
  for (const double l : {2.0, 24.0}) {
    const Point place = track.at(l).position;
    EXPECT_NEAR(track.nearest({place[0], 3.0, 0.0}), l, 1e-6);
  }
  const double still = track.nearest({10.0, 1.0, 0.0});
  EXPECT_NEAR(track.at(still).position[0], 10.0, 1e-9);
}

}  // namespace
}  // namespace surefix::raim
