// Slow faults in the last measurements of a filter that runs, for onboard use: memory of fixed
// size, no heap in a step, and a search whose cost is bounded by the window. A sensor that repeats
// one value (frozen) is not told apart: the window holds innovations, not values.
#pragma once

#include <cmath>

#include "surefix/desync/filter.hpp"
#include "surefix/drift/likelihood_ratio.hpp"
#include "surefix/drift/log_pass.hpp"
#include "surefix/drift/sliding_record.hpp"

namespace surefix::drift {

/// P(X > x) of χ² with q = 1 to 4 degrees of freedom.
[[nodiscard]] inline double ratio_tail(double x, int q) noexcept {
  const double normal = std::erfc(std::sqrt(0.5 * x)), half = std::exp(-0.5 * x);
  constexpr double two_over_pi = 0.63661977236758134308;
  if (q == 1) return normal;
  if (q == 2) return half;
  if (q == 3) return normal + std::sqrt(two_over_pi * x) * half;
  return half * (1.0 + 0.5 * x);
}

enum class Finding : std::uint8_t {
  undetectable,  ///< no onset in the window can be told from what the model itself does
  nothing,       ///< nothing beyond the risk of a false alarm that was asked for
  fault,
};

/// What a search found in the window.
struct SlidingFinding {
  Finding finding = Finding::undetectable;
  Time onset = 0;             ///< at the largest ratio [ns]
  double drop = 0.0;          ///< the largest ratio, of 𝓛
  double p_bound = 1.0;       ///< number of onsets × P(χ² > drop): at least P(false alarm)
  Profile::Vector amplitude;  ///< (q)
  Profile::Vector deviation;  ///< (q) its standard errors
  std::int32_t onsets = 0;    ///< how many were possible
};

/// The window of one filter. Every search is for one profile in one direction over the sensors.
template <class System, int Capacity, int MaxSearches = 8>
class SlidingDetector {
  using Belief = typename System::Belief;
  using Record = SlidingRecord<System::size, System::max_size, Capacity>;

 public:
  static constexpr int max_sensors = 16;
  using Direction = std::array<double, max_sensors>;

  explicit SlidingDetector(const System& system, std::size_t capacity = Capacity > 0 ? Capacity : 1)
      : system_(system), record_(system.state_size(), capacity) {}

  /// Adds a search with the `false_alarm` probability of each of its answers; its index is the
  /// number of those before it. On failure nothing is added.
  [[nodiscard]] ConfigStatus add(const Profile& profile, const Direction& direction,
                                 double false_alarm) noexcept {
    if (count_ == MaxSearches) return ConfigStatus::wrong_size;
    if (!(false_alarm > 0.0 && false_alarm < 1.0)) return ConfigStatus::risk;
    bool any = false;
    for (int s = 0; s < max_sensors; ++s) {
      const double weight = direction[static_cast<std::size_t>(s)];
      if (!std::isfinite(weight)) return ConfigStatus::not_finite;
      any = any || (weight != 0.0 && s < system_.sensor_count());
    }
    if (!any) return ConfigStatus::not_positive;
    searches_[static_cast<std::size_t>(count_++)] = {profile, direction, false_alarm};
    return ConfigStatus::ok;
  }

  /// Takes the measurements of a filter's last step, to be called after each `estimate`.
  template <int StepCapacity>
  void take(const desync::Filter<System, StepCapacity>& filter) noexcept {
    for (std::size_t i = 0; i < filter.used(); ++i) take(filter.records()[i]);
  }
  void take(const desync::Record<System>& passed) noexcept {
    const std::size_t count = record_.size();
    const Time elapsed = count > 0 ? passed.valid - record_.valid(count - 1) : 0;
    typename Belief::Matrix F = Belief::Matrix::Zero(system_.state_size(), system_.state_size());
    typename System::Transition transition;
    if (elapsed > 0 && system_.transition(elapsed, transition) == Status::ok) dense(transition, F);
    const double sigma = passed.factor * system_.sensor(passed.sensor).sigma;
    record_.add(passed.innovation, system_.row(passed.sensor, passed.at), sigma * sigma, F,
                seconds(elapsed), passed.sensor, passed.valid);
  }

  /// Looks through the window: O(window) and no more.
  [[nodiscard]] SlidingFinding look(int search) const noexcept {
    const Search& wanted = searches_[static_cast<std::size_t>(search)];
    const Profile& profile = wanted.profile;
    const int q = profile.amplitudes();
    SlidingFinding out;
    InformationSweep<Record> information(record_.state_size(), profile.size());
    SignalSweep<Record, double> signal(record_.state_size(), profile.size());
    const bool good = onset_sweep(
        record_, profile, wanted.direction.data(),
        [&](const auto& measurement, std::size_t i, double weight) {
          information.take(measurement, weight, profile.output());
          signal.take(measurement, weight, profile.output(), record_.innovation(i));
        },
        [&](std::size_t i) {
          const Detectability found = detectability(information.now(), profile.onset());
          if (found.undetectable()) return;
          ++out.onsets;
          const auto num = signal.numerator(profile.onset());
          const double ratio = likelihood_ratio(found.inverse, num);
          if (out.onsets > 1 && !(ratio >= out.drop)) return;  // of equals the earliest
          out.drop = ratio;
          out.onset = record_.valid(i);
          out.amplitude = found.inverse * num;
          out.deviation = found.inverse.diagonal().cwiseSqrt();
        },
        [&](const auto& measurement, const auto& A) {
          information.move(measurement, A);
          signal.move(measurement, A);
        });
    if (!good || out.onsets == 0) return SlidingFinding{};
    out.p_bound = std::fmin(1.0, out.onsets * ratio_tail(out.drop, q));
    out.finding = out.p_bound <= wanted.false_alarm ? Finding::fault : Finding::nothing;
    return out;
  }

  [[nodiscard]] int searches() const noexcept { return count_; }
  [[nodiscard]] const Record& record() const noexcept { return record_; }
  /// Forgets the window, as after a gap or a repair.
  void clear() noexcept { record_.clear(); }

 private:
  struct Search {
    Profile profile;
    Direction direction{};
    double false_alarm = 0.0;
  };

  System system_;
  Record record_;
  int count_ = 0;
  std::array<Search, static_cast<std::size_t>(MaxSearches)> searches_{};
};

}  // namespace surefix::drift
