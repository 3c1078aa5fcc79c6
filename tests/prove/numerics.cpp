// P stays symmetric and is never negative; and what single precision would lose.
//
// Usage: numerics STEPS. Prints one line of figures; fails if the promise does not hold.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "random.hpp"
#include "surefix/core/integrator_chain.hpp"
#include "surefix/core/predict.hpp"
#include "surefix/core/update.hpp"

namespace {

using namespace surefix;
using test::Random;

constexpr double year = 31'557'600e9;  // [ns]

/// 1 − ρ², without the cancellation of P₀₀ P₁₁ − P₀₁².
double decorrelation(const Eigen::Matrix2d& P) {
  const double product = P(0, 0) * P(1, 1), square = P(0, 1) * P(0, 1);
  const double product_rest = std::fma(P(0, 0), P(1, 1), -product);
  const double square_rest = std::fma(P(0, 1), P(0, 1), -square);
  return ((product - square) + (product_rest - square_rest)) / product;
}

struct Worst {
  double decorrelation = 1.0;  // of steps that begin above 1e-12
  long asymmetric = 0, not_positive = 0, not_finite = 0, refused = 0, claimed = 0;

  [[nodiscard]] bool bad() const {
    return claimed == 0 || decorrelation < 0.0 ||
           asymmetric + not_positive + not_finite + refused > 0;
  }
};

/// σ from 1e-9 to 1e9 and Δt from 1 ns to a year, each as likely in every decade, in one run; now
/// and then the most hostile order: a year, then a reading of 1e-9, then two microseconds.
Worst random_run(long steps) {
  Random random(7);
  const ConstantAcceleration model(0.08);
  constexpr int kinds = 4096;  // drawn once: a logarithm costs more than a step
  static ChainTransition<2> transition[kinds];
  static double variance[kinds];
  for (int i = 0; i < kinds; ++i) {
    (void)model.transition(static_cast<Time>(random.log_uniform(1.0, year)), transition[i]);
    const double sigma = random.log_uniform(1e-9, 1e9);
    variance[i] = sigma * sigma;
  }
  ChainTransition<2> longest, shortest;
  (void)model.transition(static_cast<Time>(year), longest);
  (void)model.transition(2000, shortest);
  Gaussian<2> belief{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Identity()};
  Innovation<Gaussian<2>> out;
  Worst worst;
  for (long step = 0; step < steps; ++step) {
    const int hostile = static_cast<int>(step % 64);
    const bool drawn = hostile > 2;
    const int kind = random.integer(kinds);
    predict(belief, drawn ? transition[kind] : hostile == 0 ? longest : shortest);
    const bool claimed = decorrelation(belief.P) >= 1e-12;
    const double r = drawn ? variance[random.integer(kinds)] : 1e-18;
    worst.refused += !update(belief, ComponentRow<0>{}, r, -belief.x(0), out);
    worst.asymmetric += belief.P(0, 1) != belief.P(1, 0);
    worst.not_positive += !(belief.P(0, 0) > 0.0 && belief.P(1, 1) > 0.0);
    worst.not_finite += !is_finite(belief);
    if (!claimed) continue;
    ++worst.claimed;
    worst.decorrelation = std::fmin(worst.decorrelation, decorrelation(belief.P));
  }
  return worst;
}

/// The largest errors of single precision over ordinary runs of a minute, against double: of the
/// mean in σ, of σ relative.
struct Loss {
  double mean = 0.0, sigma = 0.0;
  bool negative = false;
};
template <class Scalar>
struct Speed {  // [speed, acceleration], the model's F and Q
  Eigen::Matrix<Scalar, 2, 1> x{Scalar(20), Scalar(0)};
  Eigen::Matrix<Scalar, 2, 2> P = Eigen::Matrix<Scalar, 2, 2>::Identity();

  void step(double dt, double q, double r, double z) {
    const auto h = static_cast<Scalar>(dt), w = static_cast<Scalar>(q * q);
    Eigen::Matrix<Scalar, 2, 2> F, Q;
    F << Scalar(1), h, Scalar(0), Scalar(1);
    Q << w * h * h * h / Scalar(3), w * h * h / Scalar(2), w * h * h / Scalar(2), w * h;
    x = F * x;
    P = F * P * F.transpose() + Q;
    Gaussian<2, Scalar> belief{x, P};
    mirror(belief.P);
    Innovation<Gaussian<2, Scalar>> out;
    const auto innovation = static_cast<Scalar>(z) - belief.x(0);
    if (!update(belief, ComponentRow<0>{}, static_cast<Scalar>(r), innovation, out)) return;
    x = belief.x;
    P = belief.P;
  }
};
Loss single_precision(double shortest) {
  Random random(8);
  Speed<float> single;
  Speed<double> both;
  Loss loss;
  double truth = 20.0;
  for (int step = 0; step < 100'000; ++step) {
    const double dt = random.log_uniform(shortest, 0.1);
    const double sigma = random.uniform() < 0.5 ? 0.2 : 1.0;
    truth += 0.01 * random.normal();
    const double z = truth + sigma * random.normal();
    single.step(dt, 0.08, sigma * sigma, z);
    both.step(dt, 0.08, sigma * sigma, z);
    const double deviation = std::sqrt(both.P(0, 0));
    loss.mean = std::fmax(loss.mean, std::abs(double(single.x(0)) - both.x(0)) / deviation);
    loss.sigma =
        std::fmax(loss.sigma, std::abs(std::sqrt(double(single.P(0, 0))) / deviation - 1.0));
    loss.negative = loss.negative || !(single.P(0, 0) > 0.0F && single.P(1, 1) > 0.0F);
  }
  return loss;
}

/// Steps after which single precision has lost P: a precise reading after a gap of a day, and the
/// next a millisecond later.
long hostile_in_single(long steps) {
  Speed<float> single;
  long lost = 0;
  for (long step = 0; step < steps; ++step) {
    single.step(step % 2 == 0 ? 86400.0 : 1e-3, 0.08, 1e-8, double(single.x(0)));
    const double product = double(single.P(0, 0)) * double(single.P(1, 1));
    lost += !(product > double(single.P(0, 1)) * double(single.P(0, 1)));
  }
  return lost;
}

}  // namespace

int main(int count, char** arguments) {
  const long steps = count > 1 ? std::atol(arguments[1]) : 100'000;
  const Worst worst = random_run(steps);
  std::printf("%.0e steps: %ld asymmetric, %ld variances not positive, %ld refused; ",
              double(steps), worst.asymmetric, worst.not_positive + worst.not_finite,
              worst.refused);
  std::printf("1 - rho^2 >= %.0e in the %.2f %% within condition 1e12; ", worst.decorrelation,
              100.0 * double(worst.claimed) / double(steps));
  const Loss usual = single_precision(1e-2), fast = single_precision(1e-5);
  std::printf(
      "float loses %.0e sigma of the mean and %.0e of sigma (steps of 10-100 ms), "
      "%.0e and %.0e (from 10 us)",
      usual.mean, usual.sigma, fast.mean, fast.sigma);
  const long lost = hostile_in_single(100'000);
  std::printf(", and P itself in %.0f %% of precise readings after a day's gap\n",
              double(lost) / 1000.0);
  return worst.bad() || usual.negative || fast.negative || lost > 0 ? 1 : 0;
}
