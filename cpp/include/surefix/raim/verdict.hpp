// What the monitor says of one epoch.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "surefix/raim/monitor_settings.hpp"

namespace surefix::raim {

/// Whether there is a solution that can be tested.
enum class Solvable : std::uint8_t {
  ok = 0,
  too_few,    ///< fewer satellites than unknowns and one
  too_many,   ///< more than max_satellites
  geometry,   ///< all satellites in one direction as seen along the track
  off_track,  ///< the solution lies beyond an end of the track
  diverged,   ///< the iteration did not settle
  time,       ///< a follower's: the time is no number, or before the last one
};
constexpr const char* name(Solvable status) noexcept {
  constexpr std::array<const char*, 7> names{
      "ok",  "too few satellites", "too many satellites", "geometry", "off track", "diverged",
      "time"};
  return names[static_cast<std::size_t>(status)];
}

enum class Declared : std::uint8_t {
  not_available = 0,  ///< no solution, or none that can be tested: no number means anything
  ok,                 ///< no alarm
  excluded,           ///< an alarm; without some satellites there is none
  alarm,              ///< an alarm that no exclusion ends: do not use the position
};
constexpr const char* name(Declared declared) noexcept {
  constexpr std::array<const char*, 4> names{"not available", "ok", "excluded", "alarm"};
  return names[static_cast<std::size_t>(declared)];
}

/// NaN where there is no answer.
struct Verdict {
  static constexpr double none = std::numeric_limits<double>::quiet_NaN();

  Solvable status = Solvable::too_few;
  Declared declared = Declared::not_available;
  int used = 0;      ///< satellites in the solution
  int excluded = 0;  ///< satellites taken out

  double along = none;                    ///< l̂ [m]
  double sigma = none;                    ///< σ_l [m]
  std::array<double, max_systems> clock;  ///< of every system [m]

  // The snapshot test (13) of all satellites in view.
  double statistic = none;  ///< Λ
  int degrees = 0;
  double threshold = none;        ///< h(α)
  bool alarm = false;             ///< Λ ≥ h, or the solution is beyond K
  bool separation_alarm = false;  ///< one of |l̂ − l̂_J| beyond its threshold

  // Of the solution, after an exclusion of what is left.
  double rival = none;        ///< distance of another place that passes as well [m]; 0: none
  double p_star = none;       ///< probability that the worst critical fault is missed
  double bound = none;        ///< b: the linearisation error in standard deviations
  double bound_along = none;  ///< c: the linearisation error of l̂, in σ_l
  double e1 = none;           ///< by how much b raises p_star
  double e2 = none;           ///< by how much b raises α
  double snapshot_protection = none;  ///< half-width [m]
  double protection = none;           ///< half-width from fault hypotheses, if there are any [m]
  bool available = false;             ///< p* ≤ γ
  bool available_with_e1 = false;     ///< p* + e₁ ≤ γ

  // Of every satellite given, NaN (or false) where it is not in the solution.
  std::array<bool, max_satellites> taken_out;
  std::array<double, max_satellites> residual;       ///< whitened
  std::array<double, max_satellites> critical_bias;  ///< v_i* [m]
  std::array<double, max_satellites> missed;         ///< p(i, v_i*)

  Verdict() noexcept {
    clock.fill(none);
    taken_out.fill(false);
    residual.fill(none);
    critical_bias.fill(none);
    missed.fill(none);
  }
};

}  // namespace surefix::raim
