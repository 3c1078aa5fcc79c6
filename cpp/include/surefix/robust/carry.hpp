// How much of the mixture lives from step to step.
#pragma once

#include <cstdint>

#include "surefix/core/status.hpp"

namespace surefix::robust {

struct Carry {
  enum class Kind : std::uint8_t {
    one_gaussian,  ///< mean and covariance, and the posterior of the modes; biases are drawn anew
                   ///< in every step (the paper)
    merge,         ///< components in the same modes are merged; the lightest are cut if need be
    cut,           ///< the lightest are cut
  };
  Kind kind = Kind::merge;
  int components = 32;  ///< at most, > 0
  double cut = 1e-14;  ///< posterior mass that a step may cut off at will, ≥ 0; it is in the risk
  double memory = 1.0;  ///< how long mass that was cut stays in the risk [s], > 0: see
                        ///< `Recursion::discarded`

  [[nodiscard]] ConfigStatus check() const noexcept {
    if (components < 1 || !(memory > 0.0)) return ConfigStatus::not_positive;
    if (!(cut >= 0.0)) return ConfigStatus::negative;
    return cut < 1.0 ? ConfigStatus::ok : ConfigStatus::risk;
  }
};

}  // namespace surefix::robust
