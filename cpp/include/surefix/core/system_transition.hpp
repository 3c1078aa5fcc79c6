// The transition of a system: the motion model's on its own states, a decay on every sensor state.
#pragma once

#include <Eigen/Core>

#include "surefix/core/loop.hpp"

namespace surefix {

/// F = blockdiag(F_model, diag φ), Q = blockdiag(Q_model, diag σ²(1 − φ²)).
template <class ModelTransition, int SensorStates, int MaxSensorStates>
struct SystemTransition {
  using Decays = Eigen::Matrix<double, SensorStates, 1, 0, MaxSensorStates, 1>;

  ModelTransition model;
  int model_size;
  Decays decay;  // φ of each sensor state
  Decays noise;  // σ² (1 − φ²)

  template <class V>
  SUREFIX_INLINE void apply(V&& v) const noexcept {
    model.apply(v);
    decay_all(v);
  }
  template <class V>
  SUREFIX_INLINE void apply_transposed(V&& v) const noexcept {
    model.apply_transposed(v);
    decay_all(v);
  }
  template <class M>
  SUREFIX_INLINE void add_noise(M& P) const noexcept {
    model.add_noise(P);
    for (int s = 0; s < static_cast<int>(noise.size()); ++s)
      P(model_size + s, model_size + s) += noise(s);
  }

 private:
  template <class V>
  SUREFIX_INLINE void decay_all(V& v) const noexcept {
    for (int s = 0; s < static_cast<int>(decay.size()); ++s) v(model_size + s) *= decay(s);
  }
};

/// A system without sensor states moves as its model does.
template <class ModelTransition>
struct SystemTransition<ModelTransition, 0, 0> {
  ModelTransition model;

  template <class V>
  SUREFIX_INLINE void apply(V&& v) const noexcept {
    model.apply(v);
  }
  template <class V>
  SUREFIX_INLINE void apply_transposed(V&& v) const noexcept {
    model.apply_transposed(v);
  }
  template <class M>
  SUREFIX_INLINE void add_noise(M& P) const noexcept {
    model.add_noise(P);
  }
};

}  // namespace surefix
