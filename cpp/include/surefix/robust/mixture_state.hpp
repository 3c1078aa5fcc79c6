// All that changes while a mixture is carried from step to step: a plain value.
#pragma once

#include <vector>

#include "surefix/core/time.hpp"
#include "surefix/robust/components.hpp"
#include "surefix/robust/step_plan.hpp"

namespace surefix::robust {

struct MixtureState {
  Components components;        ///< at most as many as `Carry` says
  std::vector<double> mode;     ///< posterior of every hypothesis, for one Gaussian
  std::vector<LastValue> last;  ///< of every sensor
  Time time = 0;                ///< at which the components hold [ns]
  bool first = true;            ///< no step yet: nothing is known of the modes
  double discarded = 0.0;       ///< see `Recursion::discarded`
  double cut_last = 0.0;        ///< mass cut off after the last step
  double log_likelihood = 0.0;
};

}  // namespace surefix::robust
