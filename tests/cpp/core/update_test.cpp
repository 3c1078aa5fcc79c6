#include "surefix/core/update.hpp"

#include <gtest/gtest.h>

#include "bits.hpp"
#include "dense.hpp"
#include "surefix/core/integrator_chain.hpp"
#include "surefix/core/predict.hpp"

namespace surefix {
namespace {

using namespace test;

template <int N>
Gaussian<N> random_belief(Random& random, int n = N) {
  return {random_matrix(random, n, 1), random_covariance(random, n)};
}

template <int N>
void expect_textbook(int n = N) {
  Random random(static_cast<std::uint64_t>(n));
  for (int i = 0; i < 200; ++i) {
    Gaussian<N> belief = random_belief<N>(random, n);
    Kalman expected(belief);
    const Eigen::Matrix<double, N, 1> h = random_matrix(random, n, 1);
    const double r = random.log_uniform(1e-3, 1e3), innovation = random.normal();
    Innovation<Gaussian<N>> out;
    ASSERT_TRUE(update(belief, DenseRow<Eigen::Matrix<double, N, 1>>{h}, r, innovation, out));
    const VectorR gain = expected.P * h.template cast<Real>();
    const double S = static_cast<double>(expected.update(h, r, innovation));
    EXPECT_LT(error(belief.x, expected.x), 1e-13);
    EXPECT_LT(covariance_error(belief.P, expected.P), 1e-12);
    EXPECT_NEAR(out.variance, S, 1e-13 * S);
    EXPECT_LT(error(out.gain, gain / static_cast<Real>(S)), 1e-13);
    EXPECT_EQ(out.value, innovation);
    EXPECT_TRUE(exactly_symmetric(belief.P));
  }
}

TEST(Update, IsTheTextbookUpdate) {
  expect_textbook<1>();
  expect_textbook<2>();
  expect_textbook<3>();
  expect_textbook<6>();
  expect_textbook<Eigen::Dynamic>(2);
  expect_textbook<Eigen::Dynamic>(9);
}

TEST(Update, DoesNotDependOnTheFormOfTheRow) {
  Random random(8);
  for (int i = 0; i < 100; ++i) {
    const Gaussian<3> belief = random_belief<3>(random);
    Gaussian<3> by_component = belief, by_sparse = belief, by_dense = belief;
    Innovation<Gaussian<3>> out;
    SparseRow<2> sparse;
    sparse.add(1, 1.0);
    const Eigen::Vector3d dense{0.0, 1.0, 0.0};
    ASSERT_TRUE(update(by_component, ComponentRow<1>{}, 0.3, 0.7, out));
    ASSERT_TRUE(update(by_sparse, sparse, 0.3, 0.7, out));
    ASSERT_TRUE(update(by_dense, DenseRow<Eigen::Vector3d>{dense}, 0.3, 0.7, out));
    EXPECT_LT(error(by_component.x, by_dense.x), 1e-15);
    EXPECT_LT(covariance_error(by_component.P, by_dense.P), 1e-14);
    EXPECT_TRUE(same_belief(by_sparse, by_dense));
  }
}

/// S is `S` whatever the row: P = S·I, h = e₀, r = 0.
void expect_refused(double variance) {
  const Eigen::Vector2d x{1.0, 2.0};
  Gaussian<2> belief{x, variance * Eigen::Matrix2d::Identity()};
  const Gaussian<2> before = belief;
  Innovation<Gaussian<2>> out;
  EXPECT_FALSE(update(belief, ComponentRow<0>{}, 0.0, 1.0, out)) << variance;
  EXPECT_TRUE(same_belief(belief, before));
}

TEST(Update, RefusesAVarianceThatIsNotPositiveAndFinite) {
  for (double variance : {0.0, -0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity()})
    expect_refused(variance);
}

TEST(Update, AcceptsTheSmallestAndTheLargestVariance) {
  for (double variance : {1e-300, 1e300}) {
    Gaussian<1> belief{Eigen::Matrix<double, 1, 1>(0.0), Eigen::Matrix<double, 1, 1>(variance)};
    Innovation<Gaussian<1>> out;
    ASSERT_TRUE(update(belief, ComponentRow<0>{}, variance, 0.0, out));
    EXPECT_NEAR(belief.P(0, 0) / variance, 0.5, 1e-15);
  }
}

// ── Packs ──────────────────────────────────────────────────────────────────────────────────────

constexpr int lanes = 8;
using Lanes = Pack<lanes>;

template <int N>
using Packed = Gaussian<N, Lanes>;

template <int N>
Packed<N> pack(const std::vector<Gaussian<N>>& beliefs) {
  Packed<N> out;
  for (int l = 0; l < lanes; ++l)
    for (int j = 0; j < N; ++j) {
      out.x(j)(l) = beliefs[static_cast<std::size_t>(l)].x(j);
      for (int i = 0; i < N; ++i) out.P(i, j)(l) = beliefs[static_cast<std::size_t>(l)].P(i, j);
    }
  return out;
}

template <int N>
Gaussian<N> member(const Packed<N>& packed, int l) {
  Gaussian<N> out;
  for (int j = 0; j < N; ++j) {
    out.x(j) = packed.x(j)(l);
    for (int i = 0; i < N; ++i) out.P(i, j) = packed.P(i, j)(l);
  }
  return out;
}

template <int N>
std::vector<Gaussian<N>> random_beliefs(Random& random) {
  std::vector<Gaussian<N>> out;
  for (int l = 0; l < lanes; ++l) out.push_back(random_belief<N>(random));
  return out;
}

/// 200 predictions and updates of a pack, and of its members one by one.
template <int N, class Row>
void expect_pack(const Row& row) {
  Random random(9);
  std::vector<Gaussian<N>> single = random_beliefs<N>(random);
  Packed<N> packed = pack(single);
  for (int step = 0; step < 200; ++step) {
    const ChainTransition<N> transition(random.log_uniform(1e-3, 10.0), 0.01);
    const double r = random.log_uniform(1e-4, 10.0);
    Lanes innovation;
    for (int l = 0; l < lanes; ++l) innovation(l) = random.normal();
    predict(packed, transition);
    Innovation<Packed<N>> out;
    ASSERT_TRUE(update(packed, row, r, innovation, out));
    for (int l = 0; l < lanes; ++l) {
      Gaussian<N>& belief = single[static_cast<std::size_t>(l)];
      Innovation<Gaussian<N>> alone;
      predict(belief, transition);
      ASSERT_TRUE(update(belief, row, r, innovation(l), alone));
      ASSERT_TRUE(same_belief(member(packed, l), belief)) << "step " << step << ", lane " << l;
      ASSERT_TRUE(same_bits(out.variance(l), alone.variance));
      ASSERT_TRUE(same_bits(out.gain(N - 1)(l), alone.gain(N - 1)));
    }
  }
}

TEST(Pack, EveryLaneHasTheBitsOfADouble) {
  expect_pack<2>(ComponentRow<0>{});
  expect_pack<3>(ComponentRow<1>{});
  SparseRow<2> sparse;
  sparse.add(0, 0.7);
  sparse.add(2, -1.3);
  expect_pack<3>(sparse);
  const Eigen::Matrix<double, 5, 1> dense{0.1, -0.2, 0.3, 0.4, -0.5};
  expect_pack<5>(DenseRow<Eigen::Matrix<double, 5, 1>>{dense});
}

TEST(Pack, OneBadLaneRefusesTheUpdateOfAll) {
  for (double bad : {std::nan(""), -1.0, std::numeric_limits<double>::infinity()}) {
    Random random(10);
    std::vector<Gaussian<2>> single = random_beliefs<2>(random);
    single[5].P(0, 0) = bad;
    Packed<2> packed = pack(single);
    Innovation<Packed<2>> out;
    EXPECT_FALSE(update(packed, ComponentRow<0>{}, 0.1, Lanes(Lanes::Ones()), out));
    for (int l = 0; l < lanes; ++l)
      EXPECT_TRUE(same_belief(member(packed, l), single[static_cast<std::size_t>(l)]));
  }
}

}  // namespace
}  // namespace surefix
