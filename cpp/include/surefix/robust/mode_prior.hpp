// The prior of the hypotheses of a step given the mode of every sensor in the step before.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "surefix/core/rate_chain.hpp"
#include "surefix/robust/mode_table.hpp"

namespace surefix::robust {

/// log P(hypothesis b in this step | hypothesis a in the last one).
class ModePrior {
 public:
  enum class Kind : std::uint8_t {
    constant,  ///< each mode with its `probability` in every step, whatever was before (the paper)
    chains,    ///< a chain for every sensor, from each mode's `rate` and `duration`
    joint,     ///< one chain of all hypotheses: sensors may fail together
  };

  /// The constant prior, or a chain for every sensor.
  [[nodiscard]] ConfigStatus make(Kind kind, const std::vector<SensorModes>& sensors) {
    kind_ = kind;
    sensors_ = sensors;
    chains_.assign(sensors.size(), {});
    log_.assign(sensors.size() * square, 0.0);
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      const ConfigStatus status = kind == Kind::constant ? make_constant(s) : make_chain(s);
      if (status != ConfigStatus::ok) return status;
    }
    return ConfigStatus::ok;
  }
  /// One chain: `rates` (R × R, row-major) between the R hypotheses of the table [1/s].
  [[nodiscard]] ConfigStatus make_joint(const ModeTable& table, const std::vector<double>& rates) {
    kind_ = Kind::joint;
    const auto R = static_cast<std::size_t>(table.count());
    if (table.count() > max_joint) return ConfigStatus::too_many_hypotheses;
    if (rates.size() != R * R) return ConfigStatus::wrong_size;
    log_.assign(rates.size(), 0.0);
    chains_.assign(1, {});
    return chains_[0].make(table.count(), rates);
  }

  /// Prepares the prior of a step of `dt` ≥ 0 [s]; no heap. `first`: nothing was before, so the
  /// modes come from the chain's stationary distribution.
  void advance(double dt, bool first) noexcept {
    if (kind_ == Kind::constant) return;
    for (std::size_t s = 0; s < chains_.size(); ++s) {
      RateChain& chain = chains_[s];
      chain.advance(first ? forever : dt);
      const std::size_t size = static_cast<std::size_t>(chain.size());
      const std::size_t stride = kind_ == Kind::joint ? size : SensorModes::max_modes;
      double* log = log_.data() + s * square;
      for (std::size_t a = 0; a < size; ++a)
        for (std::size_t b = 0; b < size; ++b)
          log[a * stride + b] = std::log(chain(static_cast<int>(a), static_cast<int>(b)));
    }
  }

  [[nodiscard]] double log_probability(const ModeTable& table, int a, int b) const noexcept {
    if (kind_ == Kind::joint) return log_[static_cast<std::size_t>(a * table.count() + b)];
    double sum = 0.0;
    for (int s = 0; s < table.sensors(); ++s)
      sum += log_[static_cast<std::size_t>(s) * square +
                  static_cast<std::size_t>(table.mode(a, s) * SensorModes::max_modes +
                                           table.mode(b, s))];
    return sum;
  }

  /// Probability that more sensors are faulty than the table has at once, after hypothesis a: a sum
  /// of what is left out, not one less the rest, which may be below its rounding.
  [[nodiscard]] double left_out(const ModeTable& table, int a) const noexcept {
    if (table.complete()) return 0.0;
    if (kind_ == Kind::joint) {
      double kept = 0.0;
      for (int b = 0; b < table.count(); ++b) kept += std::exp(log_probability(table, a, b));
      return std::max(1.0 - kept, 0.0);
    }
    const auto most = static_cast<std::size_t>(std::min(table.max_faults(), max_counted));
    std::array<double, max_counted + 1> exactly{1.0};  // k faulty among the sensors so far
    double more = 0.0;
    for (std::size_t s = 0; s < sensors_.size(); ++s) {
      const auto before = static_cast<std::size_t>(table.mode(a, static_cast<int>(s)));
      const double* log = log_.data() + s * square + before * SensorModes::max_modes;
      double faulty = 0.0;
      for (int m = 1; m < sensors_[s].count(); ++m) faulty += std::exp(log[m]);
      more += exactly[most] * faulty;
      for (std::size_t k = most; k > 0; --k)
        exactly[k] = exactly[k] * std::exp(log[0]) + exactly[k - 1] * faulty;
      exactly[0] *= std::exp(log[0]);
    }
    return more;
  }

  /// The longest mean duration of a fault [s]; 0 for a constant prior.
  [[nodiscard]] double longest() const noexcept {
    double longest = 0.0;
    if (kind_ == Kind::chains)
      for (const SensorModes& modes : sensors_)
        for (int m = 1; m < modes.count(); ++m) longest = std::max(longest, modes[m].duration);
    return longest;
  }

 private:
  static constexpr int max_joint = 256;
  static constexpr int max_counted = 64;  // sensors
  static constexpr std::size_t square = SensorModes::max_modes * SensorModes::max_modes;
  static constexpr double forever = 1e12;  // [s]

  ConfigStatus make_constant(std::size_t s) {
    const SensorModes& modes = sensors_[s];
    double faulty = 0.0;
    for (int m = 1; m < modes.count(); ++m) faulty += modes[m].probability;
    if (!(faulty < 1.0)) return ConfigStatus::prior;
    for (std::size_t a = 0; a < SensorModes::max_modes; ++a) {
      double* row = &log_[s * square + a * SensorModes::max_modes];
      row[0] = std::log1p(-faulty);
      for (int m = 1; m < modes.count(); ++m) {
        if (!(modes[m].probability > 0.0)) return ConfigStatus::prior;
        row[m] = std::log(modes[m].probability);
      }
    }
    return ConfigStatus::ok;
  }
  ConfigStatus make_chain(std::size_t s) {
    const SensorModes& modes = sensors_[s];
    const int M = modes.count();
    std::vector<double> rates(static_cast<std::size_t>(M * M), 0.0);
    for (int m = 1; m < M; ++m) {
      if (!(modes[m].rate > 0.0) || !(modes[m].duration > 0.0)) return ConfigStatus::prior;
      rates[static_cast<std::size_t>(m)] = modes[m].rate;
      rates[static_cast<std::size_t>(m * M)] = 1.0 / modes[m].duration;
    }
    return chains_[s].make(M, rates);
  }

  Kind kind_ = Kind::constant;
  std::vector<SensorModes> sensors_;
  std::vector<RateChain> chains_;
  std::vector<double> log_;  // of every sensor (max_modes × max_modes), or of the joint chain
};

}  // namespace surefix::robust
