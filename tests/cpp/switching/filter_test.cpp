#include "surefix/switching/filter.hpp"

#include <gtest/gtest.h>

#include "singular_noise.hpp"
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

TYPED_TEST(SwitchingFilter, ScalesTransitionsThatAreLawsButForRounding) {
  const Prepared prepared;
  const Eigen::MatrixXd P = four_modes().transition;
  TypeParam filter, other;
  std::array<double, 16> p{}, rounded{};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) p[at(i * 4 + j)] = P(i, j);
  for (std::size_t e = 0; e < 16; ++e) rounded[e] = p[e] * (1.0 + 1e-10);
  for (auto* f : {&filter, &other})
    ASSERT_EQ(f->make(four_modes(), prepared.system.initial()), ConfigStatus::ok);
  ASSERT_TRUE(filter.set_transitions(p));
  ASSERT_TRUE(other.set_transitions(rounded));
  for (int k = 0; k < 50; ++k)
    for (auto* f : {&filter, &other})
      ASSERT_EQ(f->step(prepared.transition(), prepared.observation(), value(measurement(1, k))),
                Status::ok);
  EXPECT_NEAR(other.log_likelihood(), filter.log_likelihood(), 1e-10);
  for (int j = 0; j < 4; ++j) EXPECT_NEAR(other.mode(j), filter.mode(j), 1e-13);
}

TYPED_TEST(SwitchingFilter, NeverGivesProbabilityToAModeThatIsNeverEntered) {
  const Prepared prepared;
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(4, 4);
  P.leftCols(2).setConstant(0.5);
  ModeChain chain;
  ASSERT_TRUE(ModeChain::make({{1.0, 1.0}, {0.0, 1.0}, {1.0, 1e4}, {0.0, 1e4}}, P,
                              Eigen::Vector4d(1.0, 0.0, 0.0, 0.0), chain));
  TypeParam filter;
  ASSERT_EQ(filter.make(chain, prepared.system.initial()), ConfigStatus::ok);
  for (int k = 0; k < 50; ++k) {
    ASSERT_EQ(filter.step(prepared.transition(), prepared.observation(), value(measurement(1, k))),
              Status::ok);
    ASSERT_EQ(filter.mode(2) + filter.mode(3), 0.0);  // −200 is 100 σ of the modes that may be
  }
  std::array<double, 16> p{};
  p.fill(0.25);
  ASSERT_TRUE(filter.set_transitions(p));
  ASSERT_EQ(filter.step(prepared.transition(), prepared.observation(), value(-200.0)), Status::ok);
  EXPECT_GT(filter.mode(2) + filter.mode(3), 1.0 - 1e-12);
}

TYPED_TEST(SwitchingFilter, RefusesAMeasurementThatModesAreEquallyFarFrom) {
  const Prepared prepared;
  ModeChain chain;
  ASSERT_TRUE(ModeChain::make({{1.0, 1.0}, {1.0, 1.0}, {1.0, 1.0}, {1.0, 1.0}},
                              Eigen::MatrixXd::Constant(4, 4, 0.25), {}, chain));
  TypeParam filter;
  ASSERT_EQ(filter.make(chain, prepared.system.initial()), ConfigStatus::ok);
  EXPECT_EQ(filter.step(prepared.transition(), prepared.observation(), value(1e9)),
            Status::numerical);
  EXPECT_EQ(filter.estimate().x, prepared.system.initial().x);
  EXPECT_EQ(filter.log_likelihood(), 0.0);
  EXPECT_EQ(filter.step(prepared.transition(), prepared.observation(), value(1e7)), Status::ok);
  for (int j = 0; j < 4; ++j) EXPECT_EQ(filter.mode(j), 0.25);
}

TYPED_TEST(SwitchingFilter, RefusesWhatDoesNotFit) {
  const Prepared prepared;
  ModeChain two;
  ASSERT_TRUE(ModeChain::make({{1.0, 1.0}, {0.0, 1.0}},
                              (Eigen::Matrix2d() << 0.9, 0.1, 0.5, 0.5).finished(), {}, two));
  TypeParam filter;
  EXPECT_EQ(filter.make(two, prepared.system.initial()), ConfigStatus::wrong_size);
  EXPECT_EQ(filter.make(ModeChain(), prepared.system.initial()), ConfigStatus::wrong_size);
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

// ── One state that two or three rows read ──────────────────────────────────────────────────────

template <int Modes, int Rows>
struct OneState {
  using S = Sizes<1, Modes, Rows>;
  Belief<S> initial;
  Transition<S> transition;
  Observation<S> observation;

  explicit OneState(const Eigen::MatrixXd& R, double P0 = 1.0, double x0 = 0.0) {
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(1, 1);
    LinearSystem system;
    system.A = {one};
    system.Q = {0.1 * R.topLeftCorner(1, 1)};
    system.H = {Eigen::MatrixXd::Ones(Rows, 1)};
    system.R = {R};
    system.x0 = Eigen::VectorXd::Constant(1, x0);
    system.P0 = P0 * one;
    PreparedSystem<S> prepared;
    EXPECT_EQ(prepared.make(system), ConfigStatus::ok);
    initial = prepared.initial();
    transition = prepared.transition(1);
    observation = prepared.observation(0);
  }
  [[nodiscard]] auto filter(const std::vector<Mode>& modes) const {
    ModeChain chain;
    EXPECT_TRUE(
        ModeChain::make(modes, Eigen::MatrixXd::Constant(Modes, Modes, 1.0 / Modes), {}, chain));
    Filter<Method::imm, S> filter;
    EXPECT_EQ(filter.make(chain, initial), ConfigStatus::ok);
    return filter;
  }
};

using TwoRows = OneState<2, 2>;
const std::vector<Mode> kHealthyOrNot{{1.0, 1.0}, {0.0, 100.0}};

TEST(SwitchingFilterOfManyRows, IsTheSameInUnitsInWhichDensitiesAreNoNumbers) {
  for (const double unit : {1e150, 1e-150}) {  // two rows: densities beyond 1e±200
    const TwoRows plain(Eigen::Matrix2d::Identity());
    const TwoRows scaled(unit * unit * Eigen::Matrix2d::Identity(), unit * unit);
    auto filter = plain.filter(kHealthyOrNot), other = scaled.filter(kHealthyOrNot);
    for (int k = 1; k <= 20; ++k) {
      const Eigen::Vector2d z(0.1 * k, k % 5 == 0 ? -7.0 : 0.12 * k);
      ASSERT_EQ(filter.step(plain.transition, plain.observation, z), Status::ok);
      ASSERT_EQ(other.step(scaled.transition, scaled.observation, unit * z), Status::ok);
      ASSERT_NEAR(other.estimate().x(0) / unit, filter.estimate().x(0), 1e-13);
      ASSERT_NEAR(other.estimate().P(0, 0) / unit / unit, filter.estimate().P(0, 0), 1e-13);
      ASSERT_NEAR(other.mode(0), filter.mode(0), 1e-13);
      ASSERT_NEAR(other.log_likelihood() + 2 * k * std::log(unit), filter.log_likelihood(), 1e-9);
    }
  }
}

TEST(SwitchingFilterOfManyRows, RefusesWhatOverflowsAndStaysAsItWas) {
  const TwoRows system(Eigen::Matrix2d::Identity());
  auto filter = system.filter(kHealthyOrNot);
  const Eigen::Vector2d z(0.1, 0.2);
  ASSERT_EQ(filter.step(system.transition, system.observation, z), Status::ok);
  const double x = filter.estimate().x(0), likelihood = filter.log_likelihood();
  Transition<TwoRows::S> overflowing = system.transition;
  overflowing.F *= 1e200;
  EXPECT_EQ(filter.step(overflowing, system.observation, z), Status::numerical);
  EXPECT_EQ(filter.estimate().x(0), x);
  EXPECT_EQ(filter.log_likelihood(), likelihood);
}

TEST(SwitchingFilterOfManyRows, RefusesWhereAModeExpectsNoNumber) {
  // The state is known; what the first mode would measure of it is beyond all numbers.
  const TwoRows system(Eigen::Matrix2d::Identity(), 0.0, 1e200);
  auto filter = system.filter({{1e200, 1.0}, {0.0, 1.0}});
  EXPECT_EQ(filter.step(system.transition, system.observation, {0.1, 0.2}), Status::numerical);
  EXPECT_EQ(filter.estimate().x(0), 1e200);
  EXPECT_EQ(filter.log_likelihood(), 0.0);
}

TEST(SwitchingFilterOfManyRows, KeepsAStateThatIsKnownWhateverIsMeasured) {
  const TwoRows system(Eigen::Matrix2d::Identity(), 0.0, 3.0);
  auto filter = system.filter(kHealthyOrNot);
  ASSERT_EQ(filter.step(system.transition, system.observation, {1e10, 1e10}), Status::ok);
  EXPECT_EQ(filter.estimate().x(0), 3.0);
  EXPECT_EQ(filter.estimate().P(0, 0), 0.0);
  EXPECT_EQ(filter.mode(1), 1.0);  // of the greater noise
}

TEST(SwitchingFilterOfManyRows, RefusesAPartOfTheNoiseThatHasNoDigits) {
  const OneState<2, 3> system(test::singular_in_part());
  auto filter = system.filter(kHealthyOrNot);
  EXPECT_EQ(filter.step(system.transition, system.observation, {std::nan(""), 1.0, 2.0}),
            Status::numerical);
  EXPECT_EQ(filter.estimate().x(0), 0.0);
  EXPECT_EQ(filter.log_likelihood(), 0.0);
  EXPECT_EQ(filter.step(system.transition, system.observation, {1.0, std::nan(""), 2.0}),
            Status::ok);
}

TEST(SwitchingIMM, DoesNotFeelTheOrderInALumpedMode) {
  const Prepared prepared;
  const ModeChain four = four_modes();
  std::array<ModeChain, 2> lumped;
  ASSERT_TRUE(four.lumped({{0}, {1}, {2, 3}}, four.initial, lumped[0]));
  ASSERT_TRUE(four.lumped({{0}, {1}, {3, 2}}, four.initial, lumped[1]));
  using Three = Sizes<2, 3>;
  std::array<Filter<Method::imm, Three>, 2> filters;
  PreparedSystem<Three> system;
  ASSERT_EQ(system.make(two_states()), ConfigStatus::ok);
  for (std::size_t f = 0; f < 2; ++f)
    ASSERT_EQ(filters[f].make(lumped[f], system.initial()), ConfigStatus::ok);
  for (int k = 0; k < 50; ++k) {
    for (auto& filter : filters)
      ASSERT_EQ(filter.step(system.transition(1), system.observation(0), value(measurement(1, k))),
                Status::ok);
    ASSERT_NEAR(filters[0].estimate().x(0), filters[1].estimate().x(0), 1e-12);
    ASSERT_NEAR(filters[0].mode(2), filters[1].mode(2), 1e-13);
  }
  EXPECT_NEAR(filters[0].log_likelihood(), filters[1].log_likelihood(), 1e-10);
}

TEST(LogSum, IsMinusInfinityOfNothingButZeros) {
  EXPECT_EQ(log_sum(std::array<double, 2>{-HUGE_VAL, -HUGE_VAL}, 2), -HUGE_VAL);
  EXPECT_EQ(log_sum(std::array<double, 2>{-HUGE_VAL, -1e4}, 2), -1e4);
  EXPECT_DOUBLE_EQ(log_sum(std::array<double, 2>{1e3, 1e3}, 2), 1e3 + std::log(2.0));
}

}  // namespace
}  // namespace surefix::switching
