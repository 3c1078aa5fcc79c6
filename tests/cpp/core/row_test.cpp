#include "surefix/core/row.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "dense.hpp"

namespace surefix {
namespace {

using namespace test;
using Belief = Gaussian<4>;

Belief random_belief() {
  Random random(7);
  return {random_matrix(random, 4, 1), random_covariance(random, 4)};
}

template <class Row>
void expect_row(const Row& row, const Eigen::Vector4d& h) {
  const Belief belief = random_belief();
  EXPECT_NEAR(row.dot(belief.x), h.dot(belief.x), 1e-14);
  EXPECT_LT(error(row.times(belief), belief.P * h), 1e-15);
  Eigen::Vector4d visited = Eigen::Vector4d::Zero();
  row.for_each([&](int i, double coefficient) { visited(i) += coefficient; });
  EXPECT_TRUE(visited == h);
}

TEST(Row, OfOneComponentReadsIt) {
  expect_row(ComponentRow<0>{}, {1.0, 0.0, 0.0, 0.0});
  expect_row(ComponentRow<2>{}, {0.0, 0.0, 1.0, 0.0});
}

TEST(Row, SparseIsTheDenseRow) {
  SparseRow<3> row;
  row.add(3, -2.0);
  row.add(1, 0.5);
  expect_row(row, {0.0, 0.5, 0.0, -2.0});
}

TEST(Row, DenseSkipsItsZerosInForEach) {
  const Eigen::Vector4d h{0.0, 0.5, 0.0, -2.0};
  expect_row(DenseRow<Eigen::Vector4d>{h}, h);
  int visits = 0;
  DenseRow<Eigen::Vector4d>{h}.for_each([&](int, double) { ++visits; });
  EXPECT_EQ(visits, 2);
}

}  // namespace
}  // namespace surefix
