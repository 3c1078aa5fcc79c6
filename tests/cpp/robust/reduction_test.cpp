#include "surefix/robust/reduction.hpp"

#include <gtest/gtest.h>

#include "random.hpp"
#include "surefix/robust/merge.hpp"

namespace surefix::robust {
namespace {

using surefix::test::Random;

constexpr int n = 2;

/// Random components of two states, in `hypotheses` modes, weights from 1 to e^{−spread}.
Components random_mixture(Random& random, std::size_t count, int hypotheses, double spread) {
  Components mixture(n, count);
  mixture.resize(count);
  for (std::size_t c = 0; c < count; ++c) {
    mixture.log_weight(c) = -random.uniform(0.0, spread);
    mixture.hypothesis(c) = random.integer(hypotheses);
    const double a = random.uniform(0.5, 2.0), b = random.uniform(0.5, 2.0);
    const double r = random.uniform(-0.9, 0.9) * a * b;
    const double P[4] = {a * a, r, r, b * b};
    std::copy(P, P + 4, mixture.P(c));
    for (int i = 0; i < n; ++i) mixture.x(c)[i] = random.normal();
  }
  EXPECT_TRUE(std::isfinite(normalise(mixture)));
  return mixture;
}

double total(const Components& mixture) {
  double sum = 0.0;
  for (std::size_t c = 0; c < mixture.count(); ++c) sum += std::exp(mixture.log_weight(c));
  return sum;
}

TEST(KeepHeaviest, SaysWhatItCutOff) {
  Random random(3);
  const Components all = random_mixture(random, 50, 1, 20.0);
  std::vector<int> order(50);
  Components few(n, 7);
  const double lost = keep_heaviest(all, 0.0, order, few);
  ASSERT_EQ(few.count(), 7u);
  EXPECT_NEAR(total(few), 1.0, 1e-14);
  double smallest = 1.0, kept = 0.0;
  for (std::size_t i = 0; i < 7; ++i) {
    const double w = std::exp(all.log_weight(static_cast<std::size_t>(order[i])));
    kept += w;
    smallest = std::min(smallest, w);
  }
  EXPECT_NEAR(lost, 1.0 - kept, 1e-14);
  std::size_t heavier = 0;
  for (std::size_t c = 0; c < 50; ++c) heavier += std::exp(all.log_weight(c)) > smallest;
  EXPECT_EQ(heavier, 6u);
}

TEST(KeepHeaviest, CutsNoMoreMassThanAllowedWhereThereIsRoom) {
  Random random(4);
  const Components all = random_mixture(random, 50, 1, 40.0);
  std::vector<int> order(50);
  Components room(n, 50);
  const double lost = keep_heaviest(all, 1e-6, order, room);
  EXPECT_LE(lost, 1e-6);
  EXPECT_GT(lost, 0.0);
  EXPECT_LT(room.count(), 50u);
  EXPECT_EQ(keep_heaviest(all, 0.0, order, room), 0.0);
  EXPECT_EQ(room.count(), 50u);
}

TEST(KeepMoments, GivesOneGaussianOfTheMixture) {
  Random random(5);
  const Components all = random_mixture(random, 20, 3, 5.0);
  double x[n], P[n * n], check_x[n], check_P[n * n];
  Components one(n, 1);
  keep_moments(all, n, x, P, one);
  moments(all, n, check_x, check_P);
  ASSERT_EQ(one.count(), 1u);
  for (int i = 0; i < n; ++i) EXPECT_EQ(one.x(0)[i], check_x[i]);
  for (int i = 0; i < n * n; ++i) EXPECT_EQ(one.P(0)[i], check_P[i]);
}

class Merge : public ::testing::TestWithParam<int> {};

TEST_P(Merge, KeepsMassMeanAndCovarianceOfEveryMode) {
  Random random(6);
  const Components all = random_mixture(random, 200, 4, 30.0);
  Merger merger(n, 4, 200, [](int, int) { return true; });
  Components merged(n, 200);
  merger.merge(all, GetParam(), merged);
  EXPECT_LE(merged.count(), static_cast<std::size_t>(4 * GetParam()));
  EXPECT_NEAR(total(merged), 1.0, 1e-13);
  for (int h = 0; h < 4; ++h) {
    const auto only = [h](const Components& from) {
      Components part(n, from.count());
      std::size_t count = 0;
      for (std::size_t c = 0; c < from.count(); ++c)
        if (from.hypothesis(c) == h) part.copy(count++, from, c);
      part.resize(count);
      return part;
    };
    Components before = only(all), after = only(merged);
    EXPECT_NEAR(normalise(before), normalise(after), 1e-13);
    double x[2][n], P[2][n * n];
    moments(before, n, x[0], P[0]);
    moments(after, n, x[1], P[1]);
    for (int i = 0; i < n; ++i) EXPECT_NEAR(x[0][i], x[1][i], 1e-13);
    for (int i = 0; i < n * n; ++i) EXPECT_NEAR(P[0][i], P[1][i], 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(PerMode, Merge, ::testing::Values(1, 2, 5));

TEST(Merge, KeepsApartWhatLiesApartHoweverLight) {
  Components mixture(1, 3);
  mixture.resize(3);
  const double weight[3] = {0.6, 0.4 - 1e-9, 1e-9}, mean[3] = {0.0, 0.01, 50.0};
  for (std::size_t c = 0; c < 3; ++c) {
    mixture.log_weight(c) = std::log(weight[c]);
    mixture.hypothesis(c) = 0;
    mixture.x(c)[0] = mean[c];
    mixture.P(c)[0] = 1.0;
  }
  Merger merger(1, 1, 3, [](int, int) { return true; });
  Components merged(1, 3);
  merger.merge(mixture, 2, merged);
  ASSERT_EQ(merged.count(), 2u);
  EXPECT_NEAR(merged.x(0)[0], 0.004, 1e-8);
  EXPECT_NEAR(merged.x(1)[0], 50.0, 1e-12);
  EXPECT_NEAR(std::exp(merged.log_weight(1)), 1e-9, 1e-20);
}

TEST(Divergence, IsThatOfGaussians) {
  // D = ½ (tr Σ₁⁻¹Σ₀ − n + dᵀΣ₁⁻¹d + log |Σ₁|/|Σ₀|), computed by hand for diagonal matrices.
  const double Pi[4] = {4.0, 0.0, 0.0, 9.0}, Pj[4] = {1.0, 0.0, 0.0, 9.0};
  const double xi[2] = {0.0, 0.0}, xj[2] = {2.0, 3.0};
  Divergence divergence(2);
  const std::vector<int> both{0, 1}, second{1};
  const double log_j = divergence.factorise(Pj, both), log_i = divergence.factorise(Pi, both);
  EXPECT_NEAR(divergence(xj, Pj, xi, both, log_i - log_j),
              0.5 * (0.25 + 1.0 - 2.0 + 1.0 + 1.0 + std::log(4.0)), 1e-14);
  const double log_s = divergence.factorise(Pi, second);
  EXPECT_NEAR(divergence(xj, Pj, xi, second, log_s - std::log(9.0)), 0.5, 1e-14);
}

}  // namespace
}  // namespace surefix::robust
