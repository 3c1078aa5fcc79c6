// Expected values: mpmath 1.3 with 50 digits, the tail inverted by bisection, printed to 17.
#include "surefix/robust/alert_limits.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "random.hpp"

namespace surefix::robust {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
const double not_a_number = std::numeric_limits<double>::quiet_NaN();

struct Component {
  double weight, mean, sigma;
};

/// The columns of a mixture.
class Mixture {
 public:
  Mixture(const std::vector<Component>& components) {
    for (const Component& c : components) {
      weight_.push_back(c.weight);
      mean_.push_back(c.mean);
      sigma_.push_back(c.sigma);
    }
  }
  operator TailMixture() const {
    return {weight_.data(), mean_.data(), sigma_.data(), weight_.size()};
  }

 private:
  std::vector<double> weight_, mean_, sigma_;
};

const Mixture known({{1.0 - 1e-6, 0.0, 1.0}, {1e-6, 8.0, 1.5}});
const Mixture wide({{0.875, -3.25, 2.5},
                    {0.125, 40.0, 0.001},
                    {1e-4, -100.0, 10.0},
                    {3e-9, 77.5, 0.02},
                    {2e-13, 99.0, 6.0},
                    {1e-16, 100.0, 9.5}});

void expect_limits(const Mixture& mixture, double tail, double lower, double upper) {
  EXPECT_NEAR(upper_limit(mixture, tail), upper, 1e-12 * (1.0 + std::abs(upper))) << tail;
  EXPECT_NEAR(lower_limit(mixture, tail), lower, 1e-12 * (1.0 + std::abs(lower))) << tail;
}

TEST(AlertLimits, OneGaussian) {
  const Mixture one({{1.0, 0.0, 1.0}});
  expect_limits(one, 0.5, 0.0, 0.0);
  expect_limits(one, 0.4, -0.25334710313579974, 0.25334710313579974);
  expect_limits(one, 1e-7, -5.1993375821928169, 5.1993375821928169);
  expect_limits(one, 1e-11, -6.7060231554951363, 6.7060231554951363);
  expect_limits(one, 1e-15, -7.9413453261709968, 7.9413453261709968);
  expect_limits(one, 1e-300, -37.047096299361199, 37.047096299361199);
}

TEST(AlertLimits, ARareFaultMovesTheLimitFarOut) {
  expect_limits(known, 1e-3, -3.0902320091753013, 3.0905289797508572);
  expect_limits(known, 1e-7, -5.1993373963029612, 9.9223273483169008);
  expect_limits(known, 1e-9, -5.9978068525734891, 12.63534845925172);
  expect_limits(known, 1e-11, -6.7060230094914922, 14.397336190884237);
  expect_limits(known, 1e-15, -7.9413452021562208, 16.99671052251153);
  expect_limits(known, 1e-100, -22.92297833497068, 38.92297833497068);
  expect_limits(known, 1e-300, -47.008839156125394, 63.008839156125394);
}

TEST(AlertLimits, AMomentMatchedGaussianWouldMissTheRiskEightyThousandTimes) {
  const double moment_matched = 6.7062499357172008;  // at 1e-11
  EXPECT_NEAR(upper_tail(known, moment_matched) / 1e-11, 80580.377971158275, 1e-6);
}

TEST(AlertLimits, WeightsAndSigmasOverManyOrdersOfMagnitude) {
  expect_limits(wide, 0.5, -2.8006969341772443, -2.7999690536804492);
  expect_limits(wide, 0.1, -6.2615964446251977, 39.999158378852159);
  expect_limits(wide, 1e-3, -10.954640149151428, 40.002408916640802);
  expect_limits(wide, 1e-6, -123.26347874040841, 40.004315114820739);
  expect_limits(wide, 1e-9, -142.64890793922825, 77.508618214358148);
  expect_limits(wide, 1e-12, -156.12001244174789, 77.569269048299446);
  expect_limits(wide, 1e-15, -167.06023155495136, 114.46826753100631);
}

TEST(AlertLimits, ManyComponentsThatSumToMoreThanOne) {
  std::vector<Component> many;
  for (int i = 0; i < 650; ++i) {  // exact in binary
    many.push_back(
        {std::ldexp(0.25, -(i * 29 % 54)), i * 37 % 201 - 100.0, (1.0 + i * 53 % 97) / 16.0});
  }
  expect_limits(many, 1e-3, -112.00182504349556, 107.20058006832356);
  expect_limits(many, 1e-9, -130.84341765089075, 126.89769771286439);
  expect_limits(many, 1e-11, -135.1739705307078, 131.60183283095062);
  expect_limits(many, 1e-15, -142.6357461593427, 139.52702538663778);
}

TEST(AlertLimits, TailsKeepTheirRelativePrecision) {
  EXPECT_NEAR(upper_tail(wide, 0.0) / 0.20970042701260914, 1.0, 1e-13);
  EXPECT_NEAR(upper_tail(wide, 60.0) / 3.0002000999987181e-9, 1.0, 1e-13);
  EXPECT_NEAR(upper_tail(wide, 100.0) / 8.6813233477819272e-14, 1.0, 1e-13);
  EXPECT_NEAR(lower_tail(wide, -120.0) / 2.2750131948179208e-6, 1.0, 1e-13);
  EXPECT_EQ(upper_tail(wide, infinity), 0.0);
  EXPECT_EQ(lower_tail(wide, -infinity), 0.0);
  EXPECT_TRUE(std::isnan(upper_tail(wide, not_a_number)));
}

TEST(AlertLimits, APointMassIsBeyondWhatIsStrictlyBelowIt) {
  const Mixture mixed({{0.5, 0.0, 1.0}, {1e-9, 7.0, 0.0}});
  EXPECT_NEAR(upper_limit(mixed, 1e-9), 7.0, 4e-15);
  EXPECT_NEAR(upper_limit(mixed, 5e-10), 7.0, 4e-15);
  EXPECT_NEAR(upper_limit(mixed, 2e-9), 5.8841933548004611, 1e-11);
  const Mixture points({{0.25, -1.5, 0.0}, {0.5, 0.0, 0.0}, {0.25, 3.0, 0.0}, {0.0, 9.0, 0.0}});
  EXPECT_EQ(upper_tail(points, 0.0), 0.25);
  EXPECT_EQ(lower_tail(points, 0.0), 0.25);
  EXPECT_NEAR(upper_limit(points, 0.2), 3.0, 4e-15);
  EXPECT_NEAR(upper_limit(points, 0.25), 0.0, 4e-15);
  EXPECT_NEAR(lower_limit(points, 0.25), 0.0, 4e-15);
  EXPECT_NEAR(lower_limit(points, 1e-300), -1.5, 4e-15);
}

TEST(AlertLimits, AreSafeTightMirroredAndMonotone) {
  test::Random random(1);
  for (int run = 0; run < 500; ++run) {
    std::vector<Component> components{{1.0, 0.0, 1.0}}, mirrored = components;
    for (int n = random.integer(40); n > 0; --n) {
      components.push_back({random.log_uniform(1e-16, 1.0), random.uniform(-100.0, 100.0),
                            random.integer(10) ? random.log_uniform(1e-3, 10.0) : 0.0});
      mirrored.push_back(components.back());
      mirrored.back().mean *= -1.0;
    }
    const Mixture mixture(components);
    double inner = -infinity;
    for (double tail = 0.5; tail > 1e-300; tail *= random.log_uniform(1e-9, 1.0 - 1e-9)) {
      const double limit = upper_limit(mixture, tail);
      EXPECT_GE(limit, inner) << tail;
      EXPECT_LE(upper_tail(mixture, limit), tail * (1.0 + 1e-12));
      EXPECT_GT(upper_tail(mixture, limit - 1e-11 * (1.0 + std::abs(limit))), tail);
      EXPECT_EQ(lower_limit(Mixture(mirrored), tail), -limit);
      inner = limit;
    }
  }
}

TEST(AlertLimits, NothingIsNeededBeyondWeightsWithinTheTail) {
  const Mixture light({{1e-12, 5.0, 1.0}, {2e-12, 900.0, 0.0}});
  EXPECT_EQ(upper_limit(light, 1e-11), -infinity);
  EXPECT_EQ(lower_limit(light, 1e-11), infinity);
  EXPECT_EQ(upper_limit({nullptr, nullptr, nullptr, 0}, 1e-11), -infinity);
}

TEST(AlertLimits, WhatCannotBeComputedIsNotAvailable) {
  for (double tail : {0.0, -1e-9, -infinity, not_a_number}) {
    EXPECT_EQ(upper_limit(known, tail), infinity);
    EXPECT_EQ(lower_limit(known, tail), -infinity);
  }
  const Component healthy{1.0, 0.0, 1.0};
  for (const Component& bad : std::vector<Component>{{not_a_number, 0.0, 1.0},
                                                     {infinity, 0.0, 1.0},
                                                     {-1e-9, 0.0, 1.0},
                                                     {0.1, not_a_number, 1.0},
                                                     {0.1, -infinity, 1.0},
                                                     {0.0, infinity, 1.0},
                                                     {0.1, 0.0, not_a_number},
                                                     {0.1, 0.0, infinity},
                                                     {0.1, 0.0, -1.0}}) {
    EXPECT_EQ(upper_limit(Mixture({healthy, bad}), 1e-3), infinity);
    EXPECT_EQ(lower_limit(Mixture({bad, healthy}), 1e-3), -infinity);
  }
}

TEST(AlertLimits, RiskPerEstimate) {
  EXPECT_NEAR(per_estimate(1e-9, 36000.0) / 2.7777777791666283e-14, 1.0, 1e-14);
  EXPECT_NEAR(per_estimate(1e-300, 10.0) / 1e-301, 1.0, 1e-14);
  EXPECT_NEAR(per_estimate(0.5, 2.0), 0.29289321881345248, 1e-15);
  EXPECT_NEAR(per_estimate(0.999, 3600.0), 0.0019169811508958675, 1e-16);
  EXPECT_NEAR(per_estimate(0.1, 0.5), 0.19, 1e-15);
  EXPECT_EQ(per_estimate(0.0, 5.0), 0.0);
  EXPECT_EQ(per_estimate(1.0, 5.0), 1.0);
  for (double risk : {-1e-9, 1.1, not_a_number}) EXPECT_TRUE(std::isnan(per_estimate(risk, 5.0)));
  for (double n : {0.0, -1.0, not_a_number}) EXPECT_TRUE(std::isnan(per_estimate(1e-9, n)));
}

}  // namespace
}  // namespace surefix::robust
