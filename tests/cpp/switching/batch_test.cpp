// Many series at once: what is written, where a batch stops, and the genie.
#include <gtest/gtest.h>

#include "singular_noise.hpp"
#include "surefix/switching/any_filter.hpp"
#include "switching/switching.hpp"

namespace surefix::switching {
namespace {

using namespace testing;

constexpr int T = 20, width = 8;

LinearSystem one_state(double A, double H, double R, double P0 = 1.0, double x0 = 0.0) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(1, 1);
  LinearSystem system;
  system.A = {A * one};
  system.Q = {one};
  system.H = {H * one};
  system.R = {R * one};
  system.x0 = Eigen::VectorXd::Constant(1, x0);
  system.P0 = P0 * one;
  return system;
}

std::unique_ptr<AnyFilter> bank(Method method) {
  FilterPlan plan;
  plan.systems = {two_states()};
  plan.chain = four_modes();
  plan.p = {plan.chain.transition};
  std::unique_ptr<AnyFilter> out;
  EXPECT_EQ(AnyFilter::make(method, plan, out), ConfigStatus::ok);
  return out;
}

const std::vector<Mode> kModes{{1.0, 1.0}, {0.0, 1.0}, {1.0, 1e308}};

std::unique_ptr<AnyFilter> genie(const LinearSystem& system) {
  std::unique_ptr<AnyFilter> out;
  EXPECT_EQ(AnyFilter::make_genie(system, kModes, out), ConfigStatus::ok);
  return out;
}

/// The one-step filter, the IMM and the genie of one system.
std::vector<std::unique_ptr<AnyFilter>> all_kinds() {
  std::vector<std::unique_ptr<AnyFilter>> out;
  out.push_back(bank(Method::one_step));
  out.push_back(bank(Method::imm));
  out.push_back(genie(two_states()));
  return out;
}

std::vector<double> measurements(int runs) {
  std::vector<double> z;
  for (int run = 0; run < runs; ++run)
    for (int k = 0; k < T; ++k) z.push_back(measurement(run, k));
  return z;
}

void expect_stops(const BatchStatus& status, Status why, std::int64_t run, int step) {
  EXPECT_EQ(status.status, why);
  EXPECT_EQ(status.run, run);
  EXPECT_EQ(status.step, step);
}

TEST(SwitchingBatch, WritesWhatIsWantedAlone) {
  constexpr int runs = width + 1;
  const std::vector<double> z = measurements(runs);
  for (const auto& filter : all_kinds()) {
    std::vector<double> x(runs * T * 2), P(2 * x.size()), mode(P.size()), likelihood(runs);
    std::vector<double> x_alone(x.size()), P_alone(P.size());
    const BatchRequest in{z.data(), nullptr, 0, runs, T};
    ASSERT_EQ(filter->run(in, {x.data(), P.data(), mode.data(), likelihood.data()}).status,
              Status::ok);
    ASSERT_EQ(filter->run(in, {x_alone.data(), nullptr, nullptr, nullptr}).status, Status::ok);
    ASSERT_EQ(filter->run(in, {nullptr, P_alone.data(), nullptr, nullptr}).status, Status::ok);
    EXPECT_EQ(x_alone, x);
    EXPECT_EQ(P_alone, P);
  }
}

TEST(SwitchingBatch, StopsAtTheFirstPackThatFails) {
  for (const int runs : {1, 2, width + 1, 2 * width + 1}) {
    std::vector<double> z = measurements(runs);
    const int bad = runs > width ? 5 : 0;
    z[bad * T + 3] = HUGE_VAL;
    for (const auto& filter : all_kinds()) {
      std::vector<double> x(runs * T * 2, -77.0);
      const BatchOutput out{x.data(), nullptr, nullptr, nullptr};
      expect_stops(filter->run({z.data(), nullptr, 0, runs, T}, out), Status::not_finite, bad, 3);
      EXPECT_EQ(x.back(), -77.0);  // the last series failed, or was not begun
    }
  }
}

TEST(SwitchingGenie, RefusesASystemThatIsNone) {
  std::unique_ptr<AnyFilter> out;
  for (const LinearSystem& system : {one_state(1.0, 1.0, -1.0), two_states()}) {
    LinearSystem bad = system;
    bad.R[0](0, 0) = -1.0;
    EXPECT_EQ(AnyFilter::make_genie(bad, kModes, out), ConfigStatus::not_positive);
    EXPECT_EQ(out, nullptr);
  }
}

TEST(SwitchingGenie, SaysWhichSeriesItCannotRead) {
  // δ R of the last mode is infinite; one series of eight is in it, in the third step.
  const auto filter = genie(one_state(1.0, 1.0, 1e3));
  const std::vector<double> z(width * T, 0.5);
  std::vector<double> x(z.size());
  for (const int bad : {0, 3, width - 1}) {
    std::vector<std::int32_t> modes(z.size(), 0);
    modes[static_cast<std::size_t>(bad * T + 2)] = 2;
    const BatchOutput out{x.data(), nullptr, nullptr, nullptr};
    expect_stops(filter->run({z.data(), modes.data(), 0, width, T}, out), Status::numerical, bad,
                 2);
    expect_stops(filter->run({z.data(), modes.data(), bad, bad + 1, T}, out), Status::numerical,
                 bad, 2);
  }
}

TEST(SwitchingGenie, SaysWhereTheEstimateOverflowsOfAnyWidth) {
  const LinearSystem mean = one_state(10.0, 1.0, 1.0, 1.0, 1e308);
  // P r / S is 1e10, but P / S is no number.
  const LinearSystem variance = one_state(1.0, 1e-160, 1e-300, 1e10);
  const std::vector<double> z(width * T, 0.0);
  std::vector<double> x(z.size());
  const BatchOutput out{x.data(), nullptr, nullptr, nullptr};
  for (const int runs : {1, width}) {
    expect_stops(genie(mean)->run({z.data(), nullptr, 0, runs, T}, out), Status::numerical, 0, 1);
    expect_stops(genie(variance)->run({z.data(), nullptr, 0, runs, 1}, out), Status::numerical, 0,
                 0);
  }
}

TEST(SwitchingGenie, OfManyRowsRefusesWhatItCannotRead) {
  LinearSystem system = two_states();
  system.H = {Eigen::MatrixXd::Identity(2, 2)};
  system.R = {Eigen::MatrixXd::Identity(2, 2)};
  system.A[0] *= 1e200;
  const std::vector<double> z(2 * width * T, 0.5);
  std::vector<double> x(z.size());
  const BatchOutput out{x.data(), nullptr, nullptr, nullptr};
  for (const int runs : {1, width})
    expect_stops(genie(system)->run({z.data(), nullptr, 0, runs, T}, out), Status::numerical, 0, 1);
}

TEST(SwitchingGenie, RefusesAPartOfTheNoiseThatHasNoDigits) {
  LinearSystem system = one_state(1.0, 1.0, 1.0);
  system.H = {Eigen::MatrixXd::Ones(3, 1)};
  system.R = {test::singular_in_part()};
  std::vector<double> z(3 * width, 1.0), x(width);
  const BatchOutput out{x.data(), nullptr, nullptr, nullptr};
  const auto filter = genie(system);
  ASSERT_EQ(filter->run({z.data(), nullptr, 0, width, 1}, out).status, Status::ok);
  z[3 * 4] = std::nan("");  // the first component of series 4
  for (const int first : {0, 4})
    expect_stops(filter->run({z.data(), nullptr, first, width, 1}, out), Status::numerical, 4, 0);
}

}  // namespace
}  // namespace surefix::switching
