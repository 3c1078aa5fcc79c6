// The robust filter with everything chosen at run time.
#pragma once

#include <memory>
#include <optional>

#include "surefix/core/any_system.hpp"
#include "surefix/desync/any_filter.hpp"
#include "surefix/robust/batch.hpp"
#include "surefix/robust/filter.hpp"

namespace surefix::robust {

/// What a robust filter is told beside its system.
struct AnySettings {
  std::vector<SensorModes> modes;  ///< of every sensor
  int max_faults = 16;             ///< how many sensors, or measurements, may be faulty at once
  ModePrior::Kind prior = ModePrior::Kind::chains;
  std::vector<double> joint_rates;  ///< (R, R) for a joint chain [1/s]
  Carry carry;
  LimitRequest limits;
  /// Hypotheses per measurement with room for so many at a time (a multiple of 4, ≥ 8), from each
  /// sensor's outage mode and its probability; 0: hypotheses per sensor.
  std::size_t tree = 0;
};

/// A saved filter: everything that `restore` needs to continue with the same bits.
struct SavedFilter {
  MixtureState state;
  Time oldest = 0;
  bool started = false;
  Counters counters{};
  std::vector<Measurement> waiting;
};

/// What a batch returns beside its arrays.
using desync::BatchSummary;
using desync::PreparedLog;

class AnyFilter {
 public:
  virtual ~AnyFilter() = default;

  /// Null, with the reason in `status`, if the settings do not fit the system. Without `start` the
  /// filter starts at the earliest measurement of its first step.
  [[nodiscard]] static std::unique_ptr<AnyFilter> make(const AnySystem& system,
                                                       const AnySystem::ModelBelief& initial,
                                                       const AnySettings& settings,
                                                       std::optional<Time> start,
                                                       std::size_t capacity, ConfigStatus& status);

  [[nodiscard]] virtual Status push(Time stamp, std::int32_t sensor, double value, std::int64_t id,
                                    double factor = 1.0) noexcept = 0;
  [[nodiscard]] virtual Status estimate(Time time, RobustEstimate& out) noexcept = 0;
  [[nodiscard]] virtual const Counters& counters() const noexcept = 0;
  [[nodiscard]] virtual double log_likelihood() const noexcept = 0;
  [[nodiscard]] virtual std::size_t waiting() const noexcept = 0;
  /// All hypotheses of the last step, weights normalised.
  [[nodiscard]] virtual const Components& hypotheses() const noexcept = 0;
  [[nodiscard]] virtual const ModeTable& table() const noexcept = 0;
  /// Of every measurement used in the last step of the stream.
  [[nodiscard]] virtual const std::vector<MeasurementReport>& report() const noexcept = 0;

  /// Batch, from the filter's initial state; the filter itself stays as it is.
  [[nodiscard]] virtual PreparedLog prepare(const desync::LogView& log, Status* status) const = 0;
  [[nodiscard]] virtual BatchSummary run(const PreparedLog& log,
                                         const desync::BatchRequest& request,
                                         const BatchOutput& out) const = 0;

  [[nodiscard]] virtual SavedFilter save() const = 0;
  [[nodiscard]] virtual Status restore(const SavedFilter& saved) = 0;
  [[nodiscard]] virtual const AnySystem& system() const noexcept = 0;
};

}  // namespace surefix::robust
