// A measurement that is interrupted (noise alone) and at times ten times as noisy, by Markov
// chains: the one-step near-optimal filter of Sigalov & Oshman.
//
//   Z,value             one measurement a step; nan: missing
//
// writes the estimate, its standard deviation, and the probability that the measurement was there.
#include <cmath>
#include <surefix/core/linear_system.hpp>
#include <surefix/switching/filter.hpp>
#include <surefix/version.hpp>

#include "lines.hpp"

namespace {

using surefix::ConfigStatus;
using surefix::Status;
using Sizes = surefix::switching::Sizes<2, 4>;  // two states, four modes
using Filter = surefix::switching::Filter<surefix::switching::Method::one_step, Sizes>;

/// Modes: γ in {1, 0} beside δ in {1, 10}, which runs fastest.
[[nodiscard]] bool configure(surefix::switching::ModeChain& chain) {
  Eigen::MatrixXd gamma(2, 2), delta(2, 2);
  gamma << 0.9, 0.1, 0.6, 0.4;
  delta << 0.8, 0.2, 0.5, 0.5;
  return static_cast<bool>(
      surefix::switching::ModeChain::independent({1.0, 0.0}, gamma, {1.0, 10.0}, delta, chain));
}

[[nodiscard]] surefix::LinearSystem oscillation() {
  surefix::LinearSystem system;
  system.A = {(Eigen::Matrix2d() << 1.0, 0.5, -0.2, 0.7).finished()};
  system.Q = {Eigen::Vector2d(0.3, 0.1).asDiagonal().toDenseMatrix()};
  system.H = {(Eigen::MatrixXd(1, 2) << 1.0, 0.3).finished()};
  system.R = {Eigen::MatrixXd::Constant(1, 1, 0.5)};
  system.x0 = Eigen::Vector2d(1.0, -1.0);
  system.P0 = Eigen::Vector2d(2.0, 1.0).asDiagonal();
  return system;
}

/// What a cycle does: a function of its own, so that its stack and its time can be stated.
[[gnu::noinline]] Status step(Filter& filter, const surefix::PreparedSystem<Sizes>& system,
                              double value) {
  surefix::switching::Measured<Sizes> z;
  z(0) = value;
  return filter.step(system.transition(1), system.observation(0), z);
}

}  // namespace

int main() {
  if (!surefix::fits_library()) return refused("a library that is not the headers'");
  surefix::switching::ModeChain chain;
  surefix::PreparedSystem<Sizes> system;
  static Filter filter;
  if (!configure(chain)) return refused("modes");
  if (system.make(oscillation()) != ConfigStatus::ok) return refused("the system");
  if (filter.make(chain, system.initial()) != ConfigStatus::ok) return refused("the filter");
  // From here on nothing allocates.
  static Lines lines;
  long long bad = 0;
  while (lines.next()) {
    // Each line is a step in time: one that cannot be read is a measurement that is missing.
    const bool measured = lines.is('Z', 1);
    const double value = lines.number(0);
    const bool good = measured && !lines.bad();
    bad += !good;
    const Status status = step(filter, system, good ? value : std::nan(""));
    const auto& found = filter.estimate();
    if (status == Status::ok)
      std::printf("%.4f,%.4f,%.6f\n", found.x(0), std::sqrt(found.P(0, 0)),
                  filter.mode(0) + filter.mode(1));
    else
      std::printf("%s\n", surefix::name(status));
  }
  if (bad > 0) std::printf("bad_line,%lld\n", bad);
  return Lines::finish();
}
