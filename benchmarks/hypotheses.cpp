// W5: all 2^M hypotheses of one step of M measurements, two states, against a loop over doubles
// written by hand, level by level. Prints JSON. A program of its own: beside the filter's code the
// compiler inlines less of both, and the tree is a fifth slower.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>

#include "surefix/robust/measurement_tree.hpp"
#include "three_radars.hpp"

namespace {

using namespace surefix;
using namespace surefix::robust;
using namespace benchmark;
using desync::Measurement;

constexpr double log_healthy = -0.01005033585350145, log_outlier = -9.210340371976182;

/// Fastest of many calls [µs].
double fastest(const std::function<void()>& call) {
  double best = 1e9;
  for (int i = 0; i < 400; ++i) {
    const auto start = std::chrono::steady_clock::now();
    call();
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
    best = std::min(best, took.count());
  }
  return best;
}

struct Leg {
  Time elapsed;
  SpeedSystem::Transition transition;
};

struct Problem {
  explicit Problem(int M) : system(make_system()) {
    for (int i = 0; i <= M; ++i) {
      legs.push_back({33'000'000 + i * 1'000'000, {}});
      (void)system.transition(legs.back().elapsed, legs.back().transition);
      if (i < M) measurements.push_back({0, 30.0 + 0.3 * (i % 5) - (i == 4 ? 9.0 : 0.0), i, i % 3});
    }
  }
  SpeedSystem system;
  std::vector<Leg> legs;
  std::vector<Measurement> measurements;
};

/// One hypothesis of the loop by hand.
struct Hypothesis {
  double x0, x1, p00, p01, p11, log_weight;
};

void by_hand(const Problem& problem, std::vector<Hypothesis>& all) {
  constexpr double q = jerk * jerk;
  all[0] = {30.0, 0.0, 4.0, 0.0, 0.1, 0.0};
  std::size_t count = 1;
  for (std::size_t i = 0; i < problem.legs.size(); ++i) {
    const double t = seconds(problem.legs[i].elapsed);
    for (std::size_t h = 0; h < count; ++h) {
      Hypothesis& c = all[h];
      c.x0 += t * c.x1;
      c.p00 += t * (2.0 * c.p01 + t * c.p11) + q * t * t * t / 3.0;
      c.p01 += t * c.p11 + q * t * t / 2.0;
      c.p11 += q * t;
    }
    if (i == problem.measurements.size()) break;
    const double z = problem.measurements[i].value;
    const double r = sigma[i % 3] * sigma[i % 3];
    for (std::size_t h = 0; h < count; ++h) {
      Hypothesis& c = all[h];
      all[count + h] = c;
      all[count + h].log_weight += log_outlier;
      const double S = c.p00 + r, inverse = 1.0 / S, e = z - c.x0;
      const double k0 = c.p00 * inverse, k1 = c.p01 * inverse;
      c.x0 += k0 * e;
      c.x1 += k1 * e;
      c.p11 -= k1 * c.p01;
      c.p01 -= k0 * c.p01;
      c.p00 -= k0 * c.p00;
      c.log_weight += log_healthy - 0.5 * (std::log(6.283185307179586 * S) + e * e * inverse);
    }
    count *= 2;
  }
}

bool by_tree(const Problem& problem, MeasurementTree<SpeedSystem>& tree, const Components& root,
             Components& all) {
  tree.start(root);
  for (std::size_t i = 0; i < problem.measurements.size(); ++i)
    if (!tree.grow(problem.system, problem.legs[i], problem.measurements[i], static_cast<int>(i),
                   {log_healthy, log_outlier}))
      return false;
  tree.finish(problem.legs.back(), all);
  return tree.log_lost() < -1e300;
}

void tree(int M) {
  const Problem problem(M);
  const std::size_t count = std::size_t{1} << M;
  std::vector<Hypothesis> hand(count);
  Components root(2, 1), all(2, count);
  const double x[2] = {30.0, 0.0}, P[4] = {4.0, 0.0, 0.0, 0.1};
  root.resize(1);
  std::copy(x, x + 2, root.x(0));
  std::copy(P, P + 4, root.P(0));
  MeasurementTree<SpeedSystem> engine(problem.system, std::max<std::size_t>(count, 8));
  bool whole = true;
  const double reference = fastest([&] { by_hand(problem, hand); });
  const double own = fastest([&] { whole = whole && by_tree(problem, engine, root, all); });
  double error = whole ? 0.0 : 1.0;
  for (std::size_t h = 0; h < count; ++h) {
    error = std::max(error, std::abs(hand[h].log_weight - all.log_weight(h)));
    error = std::max(error, std::abs(hand[h].x0 - all.x(h)[0]));
    error = std::max(error, std::abs(hand[h].p00 - all.P(h)[0]));
  }
  std::printf("{\"M\": %d, \"reference_us\": %.3f, \"us\": %.3f, \"max_error\": %.1e}", M,
              reference, own, error);
}

}  // namespace

int main() {
  std::printf("[");
  for (const int M : {3, 6, 9, 12}) {
    if (M > 3) std::printf(", ");
    tree(M);
  }
  std::printf("]\n");
}
