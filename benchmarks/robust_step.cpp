// One step of the robust filter: 24 measurements, 3 sensors × 3 modes, carried drift. Prints JSON.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>

#include "surefix/robust/filter.hpp"
#include "three_radars.hpp"

namespace {

using namespace surefix;
using namespace surefix::robust;
using namespace benchmark;

/// Median of 60 steps of 0.8 s with 24 measurements, 3 sensors × 3 modes [µs], and their mean
/// number of hypotheses.
void step(const char* name, Carry::Kind kind, int components) {
  using System = FaultSystem<SpeedSystem, 3>;
  FaultMode outage, drifting;
  outage.kind = FaultKind::outage;
  outage.span = 100.0;
  drifting.kind = FaultKind::drifting;
  drifting.sigma = 20.0;
  drifting.walk = 1.0;
  outage.rate = drifting.rate = 0.005;
  outage.duration = 1.0;
  drifting.duration = 5.0;
  SensorModes modes;
  (void)modes.add(outage);
  (void)modes.add(drifting);
  const std::vector<SensorModes> all(3, modes);
  FilterSetup<System> setup{System(make_system()),
                            {},
                            {},
                            {kind, components, 1e-14, 5.0},
                            {{1.0, 0.0}, 1e-11, Sides::both}};
  (void)setup.system.make(all);
  (void)setup.table.make(all, 3);
  (void)setup.prior.make(ModePrior::Kind::chains, all);
  SpeedSystem::Belief belief;
  belief.x = Eigen::Vector2d(30.0, 0.0);
  belief.P = Eigen::Vector2d(4.0, 0.1).asDiagonal();
  Filter<System, 64> filter(setup, belief, 0);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> took;
  double hypotheses = 0.0;
  for (Time k = 0; k < 60; ++k) {
    for (Time i = 0; i < 24; ++i)
      (void)filter.push(k * 800'000'000 + i * 33'000'000 + 1, static_cast<std::int32_t>(i % 3),
                        30.0 + sigma[i % 3] * normal(random), i);
    RobustEstimate estimate;
    const auto start = std::chrono::steady_clock::now();
    (void)filter.estimate((k + 1) * 800'000'000, estimate);
    const std::chrono::duration<double, std::micro> t = std::chrono::steady_clock::now() - start;
    took.push_back(t.count());
    hypotheses += static_cast<double>(filter.recursion().hypotheses().count()) / 60.0;
  }
  std::sort(took.begin(), took.end());
  std::printf("{\"name\": \"%s\", \"us\": %.1f, \"fastest_us\": %.1f, \"hypotheses\": %.0f}", name,
              took[took.size() / 2], took.front(), hypotheses);
}

}  // namespace

int main() {
  std::printf("[");
  step("one Gaussian carried", Carry::Kind::one_gaussian, 1);
  std::printf(", ");
  step("24 components carried, cut", Carry::Kind::cut, 24);
  std::printf(", ");
  step("27 components carried, merged", Carry::Kind::merge, 27);
  std::printf("]\n");
}
