// A satellite seen from a point of the track (Lacresse, Grall & Nikiforov 2005, eq. 11).
#pragma once

#include <cmath>

#include "surefix/raim/track.hpp"

namespace surefix::raim {

inline constexpr double speed_of_light = 299792458.0;      ///< [m/s]
inline constexpr double earth_rotation = 7.2921151467e-5;  ///< WGS-84 [rad/s]

/// Beyond these [m] a satellite is not used: half a minute of light, and no clock is off by that
/// much. Squares of what is within cannot overflow.
inline constexpr double farthest = 1e10, smallest_sigma = 1e-6;

/// One pseudorange r = d(l) + clock of its system + ε, corrected for atmosphere and satellite
/// clock.
struct Satellite {
  Point position;      ///< in the frame of the track [m]
  double pseudorange;  ///< [m]
  double sigma;        ///< standard deviation of ε [m]
  int system;          ///< whose clock, 0 … max_systems − 1
};

/// d(l) and its derivatives. |d''| ≤ ‖c''‖ + `turning`, the turning of the line of sight.
struct Sight {
  double range;    ///< [m]
  double slope;    ///< d' [1]
  double second;   ///< d'' [1/m]
  double turning;  ///< ‖c'‖²/d [1/m]
};

/// Of two points [m].
[[nodiscard]] inline double distance(const Point& a, const Point& b) noexcept {
  const Point to{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  return std::sqrt(dot(to, to));
}

/// Gradient of a satellite's d over the receiver's position; `rotation` as in `look`.
[[nodiscard]] inline Point gradient(const Point& from, const Point& satellite,
                                    double rotation) noexcept {
  const double far = distance(from, satellite), sweep = rotation / speed_of_light;
  return {(from[0] - satellite[0]) / far - sweep * satellite[1],
          (from[1] - satellite[1]) / far + sweep * satellite[0], (from[2] - satellite[2]) / far};
}

/// `rotation` [rad/s]: of the frame while the signal travels, for positions that are not yet
/// rotated into the frame at reception (the Sagnac term, exact to first order); else 0.
[[nodiscard]] inline Sight look(const TrackPoint& from, const Point& satellite,
                                double rotation) noexcept {
  const Point to{satellite[0] - from.position[0], satellite[1] - from.position[1],
                 satellite[2] - from.position[2]};
  const double distance = std::sqrt(dot(to, to)), sweep = rotation / speed_of_light;
  const Point &c = from.position, &t = from.tangent, &s = satellite;
  const double toward = dot(to, t) / distance, turning = dot(t, t) / distance;
  return {distance + sweep * (s[0] * c[1] - s[1] * c[0]),
          -toward + sweep * (s[0] * t[1] - s[1] * t[0]),
          turning - toward * toward / distance - dot(to, from.bend) / distance, turning};
}

}  // namespace surefix::raim
