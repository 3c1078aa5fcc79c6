#include "surefix/core/observation.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "singular_noise.hpp"

namespace surefix {
namespace {

using S = LinearSizes<2, 3>;

struct Rows {
  Observation<S>::Rows H = (Observation<S>::Rows() << 1.0, 0.0, 0.5, 1.0, 0.0, 2.0).finished();
  Observation<S>::Noise R =
      (Observation<S>::Noise() << 2.0, 0.5, 0.1, 0.5, 1.0, -0.3, 0.1, -0.3, 0.5).finished();
};

TEST(Observation, WhitensWithoutChangingTheDensity) {
  const Rows of;
  Observation<S> observation;
  ASSERT_EQ(observation.make(of.H, of.R), ConfigStatus::ok);
  MeasuredOf<S> z(0.3, -1.0, 2.0), white = z;
  observation.whiten(white);
  double squares = 0.0, determinant = 1.0;
  for (int i = 0; i < 3; ++i) {
    squares += white(i) * white(i) * observation.precision(i);
    determinant *= observation.variance(i);
  }
  EXPECT_NEAR(squares, z.dot(of.R.inverse() * z), 1e-14);
  EXPECT_NEAR(determinant, of.R.determinant(), 1e-15);
  EXPECT_NEAR(observation.density(), 1.0 / std::sqrt(of.R.determinant()), 1e-14);
  // Rows go the same way as z: z − H x whitened is L⁻¹z − L⁻¹H x.
  const Eigen::Vector2d x(0.7, -0.2);
  MeasuredOf<S> rest = z - of.H * x;
  observation.whiten(rest);
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(rest(i), white(i) - observation.row(i, 1.0).dot(x), 1e-15);
}

TEST(Observation, OfTheComponentsThatExist) {
  const Rows of;
  Observation<S> all;
  ASSERT_EQ(all.make(of.H, of.R), ConfigStatus::ok);
  Observation<Reduced<S>> present;
  MeasuredOf<Reduced<S>> values;
  ASSERT_TRUE(present.reduce(all, MeasuredOf<S>(0.3, std::nan(""), 2.0), values));
  ASSERT_EQ(present.size(), 2);
  EXPECT_EQ(values(1), 2.0);
  EXPECT_EQ(present.row(1, 1.0)(1), 2.0 - 0.1 / 2.0 * 0.0);
  EXPECT_NEAR(present.variance(1), 0.5 - 0.1 * 0.1 / 2.0, 1e-16);
  ASSERT_TRUE(present.reduce(all, MeasuredOf<S>::Constant(std::nan("")), values));
  EXPECT_EQ(present.size(), 0);
  EXPECT_EQ(present.density(), 1.0);
}

TEST(Observation, RefusesNoiseThatIsNone) {
  Rows of;
  Observation<S> observation;
  of.R(0, 0) = 0.0;
  EXPECT_EQ(observation.make(of.H, of.R), ConfigStatus::not_positive);
  of.R(0, 0) = 2.0;
  of.R(0, 1) = 0.4;
  EXPECT_EQ(observation.make(of.H, of.R), ConfigStatus::not_semidefinite);
  of.R(0, 1) = HUGE_VAL;
  EXPECT_EQ(observation.make(of.H, of.R), ConfigStatus::not_finite);
  Rows infinite;
  infinite.H(2, 1) = HUGE_VAL;
  EXPECT_EQ(observation.make(infinite.H, infinite.R), ConfigStatus::not_finite);
}

TEST(Observation, RefusesNoiseOfAnotherSize) {
  const Rows of;
  Observation<AnyLinearSizes> observation;
  EXPECT_EQ(observation.make(of.H, of.R), ConfigStatus::ok);
  EXPECT_EQ(observation.make(of.H, of.R.topRows(2)), ConfigStatus::wrong_size);
  EXPECT_EQ(observation.make(of.H, of.R.leftCols(2)), ConfigStatus::wrong_size);
  EXPECT_EQ(observation.size(), 3);
  EXPECT_EQ(observation.variance(0), 2.0);
}

TEST(Observation, SaysIfAPartOfItsNoiseHasNoDigits) {
  const Rows of;
  Observation<S> all;
  ASSERT_EQ(all.make(of.H, test::singular_in_part()), ConfigStatus::ok);
  Observation<Reduced<S>> present;
  MeasuredOf<Reduced<S>> values;
  const double nan = std::nan("");
  EXPECT_FALSE(present.reduce(all, MeasuredOf<S>(nan, 1.0, 2.0), values));
  EXPECT_TRUE(present.reduce(all, MeasuredOf<S>(1.0, nan, 2.0), values));
  EXPECT_EQ(values(1), 2.0);
}

}  // namespace
}  // namespace surefix
