// The tree of hypotheses per measurement: what it leaves out, and the mass of that.
#include "surefix/robust/measurement_tree.hpp"

#include <gtest/gtest.h>

#include <map>

#include "surefix/core/any_system.hpp"

namespace surefix::robust {
namespace {

constexpr std::size_t room = 256;
constexpr int levels = 6;

SpeedSystem speed_system() {
  SpeedSystem system{ConstantAcceleration(0.1)};
  SpeedSystem::SensorType sensor;
  sensor.observes = {1.0, 0.0};
  sensor.sigma = 0.5;
  EXPECT_EQ(system.add(sensor), ConfigStatus::ok);
  return system;
}

struct Leg {
  Time elapsed = 100'000'000;
  SpeedSystem::Transition transition;
};

/// Grows over six measurements, the third of them far off, and prunes after each.
struct Grown {
  explicit Grown(const TreeLimits& limits, bool prune = true)
      : system(speed_system()), tree(system, room), leaves(2, room) {
    Components root(2, 3);
    root.resize(3);  // not a multiple of four
    for (std::size_t c = 0; c < 3; ++c) {
      root.log_weight(c) = std::log((1.0 + static_cast<double>(c)) / 6.0);
      root.x(c)[0] = 10.0 + 0.2 * static_cast<double>(c);
      root.P(c)[0] = root.P(c)[3] = 1.0;
    }
    tree.start(root);
    Leg leg;
    EXPECT_EQ(system.transition(leg.elapsed, leg.transition), Status::ok);
    for (int i = 0; i < levels; ++i) {
      const desync::Measurement m{0, i == 2 ? 14.0 : 10.0 + 0.1 * i, i, 0};
      EXPECT_TRUE(tree.grow(system, leg, m, i, {std::log(0.99), std::log(0.01 / 50.0)}));
      if (prune) tree.prune(limits);
    }
    tree.finish(Leg{0, {}}, leaves);
  }
  SpeedSystem system;
  MeasurementTree<SpeedSystem> tree;
  Components leaves;
  /// Σ exp of the leaves' log-weights, all or those with so many outliers.
  double mass(int from = 0) const {
    double sum = 0.0;
    for (std::size_t h = 0; h < leaves.count(); ++h)
      if (count_outliers(tree.faults(h)) >= from) sum += std::exp(leaves.log_weight(h));
    return sum;
  }
  static int count_outliers(std::uint64_t faults) {
    int count = 0;
    for (int i = 0; i < levels; ++i) count += (faults >> i & 1) != 0 ? 1 : 0;
    return count;
  }
};

TEST(MeasurementTree, KeepsAllWithoutLimits) {
  const Grown all({}), never({}, false);
  EXPECT_EQ(all.tree.count(), 3u * (1u << levels));
  EXPECT_EQ(all.tree.log_lost(), -std::numeric_limits<double>::infinity());
  for (std::size_t h = 0; h < all.leaves.count(); ++h)
    EXPECT_NEAR(all.leaves.log_weight(h), never.leaves.log_weight(h), 1e-12);
}

TEST(MeasurementTree, LeavesOutMoreOutliersThanAllowed) {
  const Grown all({}), few({0.0, 2});
  std::map<std::pair<std::uint64_t, double>, double> weight;  // by outliers and speed
  for (std::size_t h = 0; h < all.leaves.count(); ++h)
    weight[{all.tree.faults(h), all.leaves.x(h)[0]}] = all.leaves.log_weight(h);
  EXPECT_EQ(few.leaves.count(), 3u * (1u + 6u + 15u));
  for (std::size_t h = 0; h < few.leaves.count(); ++h) {
    EXPECT_LE(Grown::count_outliers(few.tree.faults(h)), 2);
    const auto same = weight.find({few.tree.faults(h), few.leaves.x(h)[0]});
    ASSERT_NE(same, weight.end());
    EXPECT_NEAR(few.leaves.log_weight(h), same->second, 1e-10);
  }
  // What was left out, and what it would have become: the bound is one, and not an idle one.
  EXPECT_LE(all.mass(3), std::exp(few.tree.log_lost()));
  EXPECT_LE(std::exp(few.tree.log_lost()), 1e3 * all.mass(3));
}

TEST(MeasurementTree, BoundsWhatIsNotWorthIt) {
  for (const double worth : {1e-9, 1e-6, 1e-3, 0.1}) {
    const Grown all({}), heavy({worth, PerMeasurement::max_measurements});
    EXPECT_LT(heavy.tree.count(), all.tree.count());
    EXPECT_LE(all.mass() - heavy.mass(), std::exp(heavy.tree.log_lost()) + 1e-12 * all.mass());
  }
}

TEST(MeasurementTree, AlwaysLeavesOne) {
  const Grown none({2.0, 0});
  EXPECT_EQ(none.tree.count(), 1u);
  EXPECT_LE(Grown({}).mass() - none.mass(), std::exp(none.tree.log_lost()));
}

}  // namespace
}  // namespace surefix::robust
