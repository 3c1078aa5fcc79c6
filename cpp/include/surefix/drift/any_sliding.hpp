// A filter with a sliding detector, for sizes known at run time. No heap in the steps.
#pragma once

#include <memory>
#include <optional>

#include "surefix/core/any_system.hpp"
#include "surefix/drift/sliding_detector.hpp"

namespace surefix::drift {

class AnySliding {
 public:
  using Direction = SlidingDetector<AnySystem, -1>::Direction;
  static constexpr int max_searches = 32;

  virtual ~AnySliding() = default;

  /// A filter as `desync::AnyFilter::make` makes it, and a window of its last measurements.
  [[nodiscard]] static std::unique_ptr<AnySliding> make(const AnySystem& system,
                                                        const AnySystem::ModelBelief& initial,
                                                        std::optional<Time> start,
                                                        std::size_t capacity, std::size_t window);
  [[nodiscard]] virtual ConfigStatus add(const Profile& profile, const Direction& direction,
                                         double false_alarm) noexcept = 0;
  [[nodiscard]] virtual Status push(Time stamp, std::int32_t sensor, double value, std::int64_t id,
                                    double factor = 1.0) noexcept = 0;
  /// Ends the step; its measurements enter the window.
  [[nodiscard]] virtual Status estimate(Time time, desync::StepError& error) noexcept = 0;
  [[nodiscard]] virtual AnySystem::Belief belief() const noexcept = 0;
  [[nodiscard]] virtual SlidingFinding look(int search) const noexcept = 0;
  /// Measurements in the window.
  [[nodiscard]] virtual std::size_t size() const noexcept = 0;
  virtual void clear() noexcept = 0;
};

}  // namespace surefix::drift
