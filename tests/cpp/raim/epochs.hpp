// Epochs on a curved track, for the tests of this folder.
#pragma once

#include <cmath>
#include <vector>

#include "random.hpp"
#include "surefix/raim/track_raim.hpp"

namespace surefix::raim::testing {

using test::Random;

/// A circular arc of 400 m radius from −300 m to 300 m, on a plane.
inline Track arc() {
  constexpr int k = 121;
  Eigen::MatrixXd points(k, 3);
  Eigen::VectorXd mileage(k);
  for (int i = 0; i < k; ++i) {
    const double l = -300.0 + 5.0 * i;
    mileage(i) = l;
    points.row(i) << 400.0 * std::sin(l / 400.0), 400.0 * (1.0 - std::cos(l / 400.0)), 0.0;
  }
  Track track;
  static_cast<void>(Track::make(points, mileage, 0.0, track));
  return track;
}

/// n satellites of `systems` systems all over the sky, σ 2 … 8 m, seen from mileage l with noise.
inline std::vector<Satellite> epoch(const Track& track, double l, int n, int systems,
                                    Random& random, double noise = 1.0) {
  const TrackPoint here = track.at(l);
  std::vector<Satellite> out;
  for (int i = 0; i < n; ++i) {
    const double azimuth = 6.283185307 * i / n + 0.3 * random.normal();
    const double elevation = 0.2 + 1.2 * std::abs(std::sin(1.7 * i + 1.0));
    const double range = 2.2e7 + 1e6 * random.normal();
    Satellite s;
    s.position = {range * std::cos(elevation) * std::cos(azimuth),
                  range * std::cos(elevation) * std::sin(azimuth), range * std::sin(elevation)};
    s.sigma = 2.0 + 6.0 * std::abs(std::cos(2.3 * i));
    s.system = i % systems;
    s.pseudorange = look(here, s.position, 0.0).range + 1000.0 * (1 + s.system) +
                    noise * s.sigma * random.normal();
    out.push_back(s);
  }
  return out;
}

}  // namespace surefix::raim::testing
