// Model and sensors chosen at run time: what a configuration file describes.
#pragma once

#include "surefix/core/any_model.hpp"
#include "surefix/core/system.hpp"

namespace surefix {

/// At most 8 model states, 16 sensors and 32 scale and bias states. No heap.
using AnySystem = System<AnyModel, Eigen::Dynamic, 32, 16>;

/// The fixed-size system of the speed model: [speed, acceleration], sensors that read the speed.
using SpeedSystem = System<ConstantAcceleration, 0, 0, 16>;

/// Whether `system` is the speed system, which then does the same work several times faster; if so
/// `out` becomes it. Results agree to rounding, not to the bit.
[[nodiscard]] bool as_speed_system(const AnySystem& system, SpeedSystem& out) noexcept;

}  // namespace surefix
