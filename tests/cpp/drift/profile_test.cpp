#include "surefix/drift/profile.hpp"

#include <gtest/gtest.h>

namespace surefix::drift {
namespace {

using Matrix = Profile::Matrix;

Profile made(const Matrix& A, const Profile::Vector& output, const Matrix& onset) {
  Profile profile;
  EXPECT_EQ(Profile::make(A, output, onset, profile), ConfigStatus::ok);
  return profile;
}

double value(const Profile& profile, double elapsed, int amplitude = 0) {
  Matrix F;
  EXPECT_TRUE(profile.transition(elapsed, F));
  const Matrix s = F * profile.onset();
  return profile.output().dot(s.col(amplitude));
}

TEST(Profile, APolynomialIsExact) {
  Matrix A(3, 3);
  A << 0, 1, 0, 0, 0, 1, 0, 0, 0;
  const Profile cubic =
      made(A, Eigen::Vector3d(1, 0, 0), (Matrix(3, 1) << 1.0, 2.0, 4.0).finished());
  EXPECT_EQ(value(cubic, 3.0), 1.0 + 2.0 * 3.0 + 2.0 * 9.0);
  EXPECT_EQ(value(cubic, 0.0), 1.0);
}

TEST(Profile, SineAndExponentialAreTheirClosedForms) {
  const double w = 0.7, tau = 3.0;
  const Profile sine = made((Matrix(2, 2) << 0, w, -w, 0).finished(), Eigen::Vector2d(1, 0),
                            (Matrix(2, 2) << 0, 1, 1, 0).finished());
  const Profile rising = made((Matrix(2, 2) << 0, 0, 0, -1 / tau).finished(),
                              Eigen::Vector2d(1, -1), (Matrix(2, 1) << 1, 1).finished());
  for (const double t : {1e-9, 0.1, 1.0, 12.5, 300.0}) {
    EXPECT_NEAR(value(sine, t, 0), std::sin(w * t), 1e-13 * (1 + w * t));
    EXPECT_NEAR(value(sine, t, 1), std::cos(w * t), 1e-13 * (1 + w * t));
    EXPECT_NEAR(value(rising, t), -std::expm1(-t / tau), 1e-14);
  }
}

TEST(Profile, WhatOverflowsIsRefused) {
  const Profile grown =
      made(Matrix::Constant(1, 1, 10.0), Profile::Vector::Ones(1), Matrix::Ones(1, 1));
  Matrix F;
  EXPECT_TRUE(grown.transition(70.0, F));
  EXPECT_FALSE(grown.transition(80.0, F));
  EXPECT_FALSE(grown.transition(1e300, F));
}

TEST(Profile, RefusesWhatIsNone) {
  const Matrix one = Matrix::Ones(1, 1), two = Matrix::Ones(2, 2);
  const Profile::Vector c = Profile::Vector::Ones(1);
  Profile profile = made(Matrix::Constant(1, 1, 0.5), c, one);
  EXPECT_EQ(Profile::make(two, c, one, profile), ConfigStatus::wrong_size);
  EXPECT_EQ(Profile::make(one, c, two, profile), ConfigStatus::wrong_size);
  EXPECT_EQ(Profile::make(one, c, Matrix::Ones(1, 2), profile), ConfigStatus::wrong_size);
  EXPECT_EQ(Profile::make(Matrix(0, 0), Profile::Vector(0), Matrix(0, 1), profile),
            ConfigStatus::wrong_size);
  EXPECT_EQ(Profile::make(Matrix::Ones(1, 2), c, one, profile), ConfigStatus::wrong_size);
  EXPECT_EQ(Profile::make(one, Profile::Vector::Ones(2), one, profile), ConfigStatus::wrong_size);
  EXPECT_EQ(Profile::make(one, c, Matrix(1, 0), profile), ConfigStatus::wrong_size);
  EXPECT_EQ(Profile::make(Matrix::Constant(1, 1, NAN), c, one, profile), ConfigStatus::not_finite);
  EXPECT_EQ(Profile::make(one, NAN * c, one, profile), ConfigStatus::not_finite);
  EXPECT_EQ(Profile::make(one, c, INFINITY * one, profile), ConfigStatus::not_finite);
  EXPECT_EQ(profile.size(), 1);  // and stays as it was
  EXPECT_EQ(profile.amplitudes(), 1);
  EXPECT_NEAR(value(profile, 2.0), std::exp(1.0), 1e-13);
}

}  // namespace
}  // namespace surefix::drift
