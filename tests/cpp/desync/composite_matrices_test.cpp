// The identities between the paper's backward-looking matrices and the inverse-free ones.
#include "surefix/desync/composite_matrices.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "composite_reference.hpp"

namespace surefix::desync {
namespace {

using namespace test;
using Eigen::MatrixXd;

struct Matrices {
  StepCase c;
  CompositeMatrices m;
  BackwardMatrices b;
  explicit Matrices(std::uint64_t seed) {
    Random random(seed);
    c = random_step(random, 3, 2, {1, 2, 1});
    m = composite_matrices(c.legs, c.observations);
    EXPECT_TRUE(backward_matrices(c.legs, c.observations, m, b));
  }
};

TEST(CompositeMatrices, AreProductsOfTheLegs) {
  const Matrices all(71);
  const auto& legs = all.c.legs;
  EXPECT_LT(error(all.m.F, legs[3].F * legs[2].F * legs[1].F * legs[0].F), 1e-14);
  EXPECT_LT(error(all.m.W.leftCols(3), legs[3].F * legs[2].F * legs[1].F), 1e-14);
  EXPECT_TRUE(all.m.W.rightCols(3).isIdentity(0.0));
  EXPECT_LT(error(all.m.G.leftCols(2), legs[3].F * legs[2].F * legs[1].F * legs[0].G), 1e-14);
  EXPECT_TRUE(all.m.G.rightCols(2) == legs[3].G);
  const MatrixXd& H = all.c.observations[1].H;
  EXPECT_LT(error(all.m.HF.middleRows(1, 2), H * legs[1].F * legs[0].F), 1e-14);
}

TEST(CompositeMatrices, InputsAndNoisesStandOnTheDiagonal) {
  const Matrices all(72);
  MatrixXd J = MatrixXd::Zero(4, 8), Omega = MatrixXd::Zero(12, 12);
  J.block(0, 0, 1, 2) = all.c.observations[0].J;
  J.block(1, 2, 2, 2) = all.c.observations[1].J;
  J.block(3, 4, 1, 2) = all.c.observations[2].J;
  for (int i = 0; i < 4; ++i)
    Omega.block(3 * i, 3 * i, 3, 3) = all.c.legs[static_cast<std::size_t>(i)].Q;
  EXPECT_TRUE(all.m.J == J);
  EXPECT_TRUE(all.m.Omega == Omega);
  EXPECT_TRUE(all.m.Upsilon == all.c.Upsilon);
}

TEST(CompositeMatrices, HFIsHTimesF) {
  for (std::uint64_t seed : {73, 74, 75}) {
    const Matrices all(seed);
    EXPECT_LT(error(all.b.H * all.m.F, all.m.HF), 1e-12);
  }
}

TEST(CompositeMatrices, LIsHWLessTheta) {
  for (std::uint64_t seed : {76, 77, 78}) {
    const Matrices all(seed);
    EXPECT_LT(error(all.b.H * all.m.W - all.b.Theta, all.m.L), 1e-12);
  }
}

TEST(CompositeMatrices, LGIsHGLessXi) {
  const Matrices all(79);
  EXPECT_LT(error(all.b.H * all.m.G - all.b.Xi, all.m.LG), 1e-12);
  EXPECT_LT(error(all.m.J - all.b.Xi, all.b.Jtilde), 1e-14);
}

TEST(CompositeMatrices, ThePapersCovarianceUpdateCorrected) {
  const Matrices all(80);
  const auto& m = all.m;
  const auto& b = all.b;
  const MatrixXd prior = m.F * all.c.P * m.F.transpose() + m.W * m.Omega * m.W.transpose();
  const StepReference expected = brute_force(all.c);
  const MatrixXd K = (expected.C * expected.Gamma.inverse()).cast<double>();
  const MatrixXd posterior =
      (MatrixXd::Identity(3, 3) - K * b.H) * prior + K * b.Theta * m.Omega * m.W.transpose();
  EXPECT_LT(error(posterior, expected.P), 1e-11);
}

TEST(CompositeMatrices, BackwardOnesDoNotExistForASingularLegAfterAnObservation) {
  Matrices all(81);
  BackwardMatrices out;
  all.c.legs[2].F.row(0).setZero();
  EXPECT_FALSE(backward_matrices(all.c.legs, all.c.observations, all.m, out));
}

TEST(CompositeMatrices, BackwardOnesExistForASingularFirstLeg) {
  Matrices all(82);
  all.c.legs[0].F.setZero();
  const auto m = composite_matrices(all.c.legs, all.c.observations);
  BackwardMatrices b;
  ASSERT_TRUE(backward_matrices(all.c.legs, all.c.observations, m, b));
  EXPECT_TRUE(m.HF.isZero(0.0));
  EXPECT_LT(error(b.H * m.W - b.Theta, m.L), 1e-12);
}

}  // namespace
}  // namespace surefix::desync
