// The filter with everything chosen at run time: the speed system runs as its fixed-size code, any
// other as the bounded one. The step functions (`push`, `estimate`) do not touch the heap.
#pragma once

#include <memory>
#include <optional>

#include "surefix/core/any_system.hpp"
#include "surefix/desync/batch.hpp"
#include "surefix/desync/filter.hpp"

namespace surefix::desync {

/// A saved filter: everything that `restore` needs to continue with the same bits.
struct SavedFilter {
  AnySystem::Belief belief;
  Time time;
  Time oldest;
  bool started;
  LogLikelihood::Saved likelihood;
  Counters counters;
  std::vector<Measurement> waiting;
};

/// What a batch returns beside its arrays.
struct BatchSummary {
  std::size_t estimates = 0;   ///< how many were made
  Status status = Status::ok;  ///< why the next one could not be made
  double log_likelihood = 0.0;
};

/// A log sorted for a batch, between `prepare` and `run`.
struct PreparedLog {
  SortedLog sorted;
  std::size_t distinct = 0;  ///< validity times from the start on: so many estimates at most
  Time start = 0;
};

class AnyFilter {
 public:
  virtual ~AnyFilter() = default;

  /// Room for `capacity` measurements a step. Without `start` the filter starts at the earliest
  /// measurement of its first step.
  [[nodiscard]] static std::unique_ptr<AnyFilter> make(const AnySystem& system,
                                                       const AnySystem::ModelBelief& initial,
                                                       std::optional<Time> start,
                                                       std::size_t capacity);
  /// A filter of another system that continues from this one (`carry_over`); measurements that
  /// wait in the buffer are kept unless their sensor is gone: those become `unknown_sensor`.
  /// `old_index`: for every sensor of the new system its index in the old one, −1 if new.
  [[nodiscard]] virtual std::unique_ptr<AnyFilter> with_system(
      const AnySystem& system, const std::vector<int>& old_index) const = 0;

  [[nodiscard]] virtual Status push(Time stamp, std::int32_t sensor, double value, std::int64_t id,
                                    double factor = 1.0) noexcept = 0;
  [[nodiscard]] virtual Status estimate(Time time, StepError& error) noexcept = 0;
  /// Estimate of the last step, its time, and the noise of its measurements in order of validity.
  [[nodiscard]] virtual AnySystem::Belief belief() const noexcept = 0;
  [[nodiscard]] virtual std::vector<NoiseEstimate> noise() const = 0;
  [[nodiscard]] virtual const Counters& counters() const noexcept = 0;
  [[nodiscard]] virtual double log_likelihood() const noexcept = 0;
  [[nodiscard]] virtual std::size_t waiting() const noexcept = 0;

  /// Batch, from the filter's initial state; the filter itself stays as it is.
  [[nodiscard]] virtual PreparedLog prepare(const LogView& log, Status* status) const = 0;
  [[nodiscard]] virtual BatchSummary run(const PreparedLog& log, const BatchRequest& request,
                                         const BatchOutput& out) const = 0;

  [[nodiscard]] virtual SavedFilter save() const = 0;
  [[nodiscard]] virtual Status restore(const SavedFilter& saved) noexcept = 0;
  [[nodiscard]] virtual const AnySystem& system() const noexcept = 0;
};

}  // namespace surefix::desync
