// Sensors come and go while a filter runs: the belief is carried from one system to another.
#pragma once

#include "surefix/core/system.hpp"

namespace surefix {

/// The belief of `from` (of system `old_system`) as a belief of `new_system`, same model.
///
/// `old_index(s)`: which sensor of the old system the new system's sensor s is, −1 for a new one.
/// States of removed sensors are marginalised out, states of new sensors start in their stationary
/// distribution, everything else keeps its mean and its covariance with the rest.
template <class Old, class New, class OldIndex>
[[nodiscard]] typename New::Belief carry_over(const Old& old_system,
                                              const typename Old::Belief& from,
                                              const New& new_system,
                                              OldIndex&& old_index) noexcept {
  const int n = new_system.state_size(), m = new_system.model_size();
  std::array<int, New::max_size> source;  // the old state that a new state continues, or −1
  source.fill(-1);
  for (int i = 0; i < m; ++i) source[static_cast<std::size_t>(i)] = i;
  for (int s = 0; s < new_system.sensor_count(); ++s) {
    const int old = old_index(s);
    if (old < 0) continue;
    const int scale = new_system.scale_state(s), bias = new_system.bias_state(s);
    if (scale >= 0) source[static_cast<std::size_t>(scale)] = old_system.scale_state(old);
    if (bias >= 0) source[static_cast<std::size_t>(bias)] = old_system.bias_state(old);
  }
  typename New::ModelBelief nothing{New::ModelBelief::Vector::Zero(m),
                                    New::ModelBelief::Matrix::Zero(m, m)};
  typename New::Belief to = new_system.initial(nothing);
  for (int i = 0; i < n; ++i) {
    const int a = source[static_cast<std::size_t>(i)];
    if (a < 0) continue;
    to.x(i) = from.x(a);
    for (int j = 0; j < n; ++j) {
      const int b = source[static_cast<std::size_t>(j)];
      if (b >= 0) to.P(i, j) = from.P(a, b);
    }
  }
  return to;
}

}  // namespace surefix
