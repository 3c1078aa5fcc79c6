// The hypotheses per sensor: which mode every sensor is in. Modes^sensors of them, or fewer where
// only so many sensors may be faulty at once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "surefix/robust/fault_mode.hpp"

namespace surefix::robust {

/// All combinations of modes with at most `max_faults` sensors that are not healthy. Combination 0
/// is: all healthy.
class ModeTable {
 public:
  static constexpr int max_hypotheses = 1 << 14;

  ModeTable() = default;

  /// `too_many_hypotheses` before anything is enumerated that would not fit.
  [[nodiscard]] ConfigStatus make(const std::vector<SensorModes>& sensors, int max_faults) {
    sensors_ = static_cast<int>(sensors.size());
    const auto fallible = std::count_if(sensors.begin(), sensors.end(),
                                        [](const SensorModes& s) { return s.count() > 1; });
    complete_ = max_faults >= fallible;
    max_faults_ = max_faults;
    modes_.clear();
    std::vector<std::uint8_t> row(sensors.size(), 0);
    return fill(sensors, 0, max_faults, row) ? ConfigStatus::ok : ConfigStatus::too_many_hypotheses;
  }

  [[nodiscard]] int sensors() const noexcept { return sensors_; }
  [[nodiscard]] int count() const noexcept {
    return sensors_ == 0 ? 1 : static_cast<int>(modes_.size()) / sensors_;
  }
  /// Whether no combination was left out.
  [[nodiscard]] bool complete() const noexcept { return complete_; }
  /// How many sensors are faulty at once, at most.
  [[nodiscard]] int max_faults() const noexcept { return max_faults_; }
  /// Mode of `sensor` under hypothesis h.
  [[nodiscard]] int mode(int h, int sensor) const noexcept {
    return modes_[static_cast<std::size_t>(h * sensors_ + sensor)];
  }

 private:
  bool fill(const std::vector<SensorModes>& sensors, std::size_t sensor, int faults,
            std::vector<std::uint8_t>& row) {
    if (sensor == sensors.size()) {
      if (count() >= max_hypotheses) return false;
      modes_.insert(modes_.end(), row.begin(), row.end());
      return true;
    }
    for (int mode = 0; mode < sensors[sensor].count(); ++mode) {
      if (mode > 0 && faults == 0) break;
      row[sensor] = static_cast<std::uint8_t>(mode);
      if (!fill(sensors, sensor + 1, mode > 0 ? faults - 1 : faults, row)) return false;
    }
    row[sensor] = 0;
    return true;
  }

  int sensors_ = 0;
  int max_faults_ = 0;
  bool complete_ = true;
  std::vector<std::uint8_t> modes_;
};

}  // namespace surefix::robust
