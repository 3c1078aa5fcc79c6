#include "surefix/switching/filter.hpp"

#include <gtest/gtest.h>

#include "switching/switching.hpp"

namespace surefix::switching {
namespace {

using namespace testing;

template <class F>
class SwitchingFilter : public ::testing::Test {};
using Filters = ::testing::Types<Filter<Method::imm, Two>, Filter<Method::one_step, Two>>;
TYPED_TEST_SUITE(SwitchingFilter, Filters, );  // its "..." is empty

constexpr Method method(const Filter<Method::imm, Two>*) { return Method::imm; }
constexpr Method method(const Filter<Method::one_step, Two>*) { return Method::one_step; }

Measured<Two> value(double z) {
  Measured<Two> out;
  out(0) = z;
  return out;
}

TYPED_TEST(SwitchingFilter, HasTheBitsOfABatchOfAnyWidth) {
  constexpr int T = 120, runs = 11;  // a full pack and a part of one
  const Prepared prepared;
  BankBatch<Two> batch;
  ASSERT_EQ(batch.make({two_states()}, four_modes(), {four_modes().transition}, {}),
            ConfigStatus::ok);
  std::vector<double> z, x(runs * T * 2), P(runs * T * 4), mode(runs * T * 4), likelihood(runs);
  for (int run = 0; run < runs; ++run)
    for (int k = 0; k < T; ++k) z.push_back(measurement(run, k));
  const BatchOutput out{x.data(), P.data(), mode.data(), likelihood.data()};
  constexpr Method kind = method(static_cast<const TypeParam*>(nullptr));
  ASSERT_EQ(batch.template run<kind>({z.data(), nullptr, 0, runs, T}, out).status, Status::ok);

  for (int run = 0; run < runs; ++run) {
    TypeParam filter;
    ASSERT_EQ(filter.make(four_modes(), prepared.system.initial()), ConfigStatus::ok);
    for (int k = 0; k < T; ++k) {
      ASSERT_EQ(
          filter.step(prepared.transition(), prepared.observation(), value(measurement(run, k))),
          Status::ok);
      const std::size_t row = static_cast<std::size_t>(run * T + k);
      ASSERT_EQ(filter.estimate().x(0), x[2 * row]) << run << " " << k;
      ASSERT_EQ(filter.estimate().P(1, 0), P[4 * row + 2]);
      ASSERT_EQ(filter.mode(2), mode[4 * row + 2]);
    }
    EXPECT_EQ(filter.log_likelihood(), likelihood[static_cast<std::size_t>(run)]);
  }
}

TYPED_TEST(SwitchingFilter, IsAsItWasAfterAStepThatFails) {
  const Prepared prepared;
  TypeParam filter, other;
  ASSERT_EQ(filter.make(four_modes(), prepared.system.initial()), ConfigStatus::ok);
  ASSERT_EQ(filter.step(prepared.transition(), prepared.observation(), value(0.3)), Status::ok);
  other = filter;
  EXPECT_EQ(filter.step(prepared.transition(), prepared.observation(), value(HUGE_VAL)),
            Status::not_finite);
  Transition<Two> overflowing = prepared.transition();
  overflowing.F *= 1e200;
  EXPECT_EQ(filter.step(overflowing, prepared.observation(), value(0.3)), Status::numerical);
  for (auto* f : {&filter, &other})
    ASSERT_EQ(f->step(prepared.transition(), prepared.observation(), value(0.7)), Status::ok);
  EXPECT_EQ(filter.estimate().x(0), other.estimate().x(0));
  EXPECT_EQ(filter.log_likelihood(), other.log_likelihood());
}

TYPED_TEST(SwitchingFilter, HoldsOrRefusesAbsurdMeasurements) {
  const Prepared prepared;
  TypeParam filter;
  ASSERT_EQ(filter.make(four_modes(), prepared.system.initial()), ConfigStatus::ok);
  int refused = 0;
  for (const double z : {0.0, -3.945573e28, 4.60889, -3.945573e28, -0.000488281, 1e8, 0.124512,
                         -1e10, 1e5, 1e20, 1e150, 0.1, 0.2}) {
    const double x = filter.estimate().x(0), before = filter.mode(0);
    if (filter.step(prepared.transition(), prepared.observation(), value(z)) != Status::ok) {
      ++refused;
      EXPECT_GT(std::abs(z), 1e10);
      EXPECT_EQ(filter.estimate().x(0), x);
      EXPECT_EQ(filter.mode(0), before);
    }
    double sum = 0.0;
    for (int j = 0; j < 4; ++j) sum += filter.mode(j);
    EXPECT_NEAR(sum, 1.0, 1e-14) << z;
    const auto& P = filter.estimate().P;
    EXPECT_GT(P(0, 0), 0.0);
    EXPECT_GT(P(1, 1), 0.0);
    EXPECT_LT(P(0, 1) * P(0, 1), P(0, 0) * P(1, 1)) << z;
    EXPECT_LT(P(0, 0), 1e3) << z;
  }
  EXPECT_EQ(refused, 4);  // all beyond 1e10
}

// A fuzzer's: after 4e71 the modes' equal means differed by rounding, whose squares were P's.
TYPED_TEST(SwitchingFilter, NeverTakesRoundingForSpread) {
  const Prepared prepared;
  TypeParam filter;
  ASSERT_EQ(filter.make(four_modes(), prepared.system.initial()), ConfigStatus::ok);
  for (const double z : {std::nan(""), -4.16683e71, -6.14941, -6.14941, 8.60059, 0.0, 0.0, 0.0}) {
    const Status status = filter.step(prepared.transition(), prepared.observation(), value(z));
    EXPECT_EQ(status == Status::ok, !(z < -1e70)) << z;
    EXPECT_LT(filter.estimate().P(0, 0), 1e3) << z;
  }
}

TYPED_TEST(SwitchingFilter, AsksTheChainAloneWhereNothingIsMeasured) {
  const Prepared prepared;
  const ModeChain chain = four_modes();
  TypeParam filter;
  ASSERT_EQ(filter.make(chain, prepared.system.initial()), ConfigStatus::ok);
  Eigen::VectorXd law = chain.initial;
  ASSERT_EQ(filter.step(prepared.transition(), prepared.observation(), value(0.3)), Status::ok);
  for (int j = 0; j < 4; ++j) law(j) = filter.mode(j);
  for (int k = 0; k < 5; ++k) {
    ASSERT_EQ(filter.step(prepared.transition(), prepared.observation(), value(std::nan(""))),
              Status::ok);
    law = chain.transition.transpose() * law;
    for (int j = 0; j < 4; ++j) EXPECT_NEAR(filter.mode(j), law(j), 1e-15);
  }
}

TYPED_TEST(SwitchingFilter, TakesTransitionsOfItsOwnOnlyIfTheyAreLaws) {
  const Prepared prepared;
  TypeParam filter;
  ASSERT_EQ(filter.make(four_modes(), prepared.system.initial()), ConfigStatus::ok);
  std::array<double, 16> p{};
  EXPECT_FALSE(filter.set_transitions(p));
  for (std::size_t i = 0; i < 4; ++i) p[i * 4 + i] = 1.0;
  EXPECT_TRUE(filter.set_transitions(p));
  for (int k = 0; k < 3; ++k)
    ASSERT_EQ(filter.step(prepared.transition(), prepared.observation(), value(0.1)), Status::ok);
  p[0] = std::nan("");
  EXPECT_FALSE(filter.set_transitions(p));
}

TYPED_TEST(SwitchingFilter, RefusesWhatDoesNotFit) {
  const Prepared prepared;
  ModeChain two;
  ASSERT_TRUE(ModeChain::make({{1.0, 1.0}, {0.0, 1.0}},
                              (Eigen::Matrix2d() << 0.9, 0.1, 0.5, 0.5).finished(), {}, two));
  TypeParam filter;
  EXPECT_EQ(filter.make(two, prepared.system.initial()), ConfigStatus::wrong_size);
  Belief<Two> bad = prepared.system.initial();
  bad.P(0, 0) = -1.0;
  EXPECT_EQ(filter.make(four_modes(), bad), ConfigStatus::not_semidefinite);
}

TEST(SwitchingIMM, RemembersInLogarithmsAModeThatIsAlmostExcluded) {
  // A chain that stays where it is: after a gross outlier mode 0 has e^-5000, and later
  // measurements near zero bring it back as e^5000.
  const Prepared prepared;
  ModeChain chain;
  ASSERT_TRUE(ModeChain::make({{1.0, 1.0}, {1.0, 1e4}, {0.0, 1.0}, {0.0, 1e4}},
                              Eigen::MatrixXd::Identity(4, 4), Eigen::VectorXd::Constant(4, 0.25),
                              chain));
  Filter<Method::imm, Two> filter;
  ASSERT_EQ(filter.make(chain, prepared.system.initial()), ConfigStatus::ok);
  const auto step = [&](double z) {
    ASSERT_EQ(filter.step(prepared.transition(), prepared.observation(), value(z)), Status::ok);
  };
  step(150.0);
  EXPECT_EQ(filter.mode(2), 0.0);
  EXPECT_GT(filter.mode(1) + filter.mode(3), 1.0 - 1e-12);
  for (int k = 0; k < 6000; ++k) step(0.2 * (k % 3 - 1));
  EXPECT_GT(filter.mode(2) + filter.mode(0), 1.0 - 1e-12);
}

}  // namespace
}  // namespace surefix::switching
