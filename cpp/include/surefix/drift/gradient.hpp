// ∂𝓛/∂z of every measurement of a linear system, 𝓛 = Σ log det S + νᵀS⁻¹ν: Parellier, Barrau &
// Bonnabel 2023, (3)-(6) forward and (20)-(22) backward, 2N small steps and no more.
#pragma once

#include "surefix/core/linear_system.hpp"
#include "surefix/core/predict.hpp"
#include "surefix/desync/backward_sweep.hpp"

namespace surefix::drift {

/// How many numbers the backward sweep needs of each scalar measurement: ν/S and the gain.
[[nodiscard]] constexpr int kept_of_each(int n) noexcept { return 1 + n; }

/// The rows of every observation as they are.
struct AnyRows {
  template <class S, class F>
  SUREFIX_INLINE static auto with(const Observation<S>& observation, int i, F&& f) noexcept {
    const auto h = observation.row(i, 1.0);
    return f(DenseRow<std::decay_t<decltype(h)>>{h});
  }
};
/// All that read the first state as it is: there the update has nothing to correct.
struct FirstState {
  template <class S, class F>
  SUREFIX_INLINE static auto with(const Observation<S>&, int, F&& f) noexcept {
    return f(ComponentRow<0>{});
  }
};

/// z (T, m), all of it there; `inputs` (T − 1, n) or null; writes `out` (T, m). `kept`: room for
/// T m `kept_of_each` numbers. `Rows`: how they are read. `numerical` if an innovation's variance
/// is not positive and finite.
template <class Rows, class S>
[[nodiscard]] Status likelihood_gradient(const PreparedSystem<S>& system, const double* z, int T,
                                         const double* inputs, double* kept, double* out) noexcept {
  using Gain = Eigen::Map<const typename BeliefOf<S>::Vector>;
  const int n = system.size(), m = system.measured();
  BeliefOf<S> belief = system.initial();
  MeasuredOf<S> white(m);
  for (int k = 0; k < T; ++k) {
    if (k > 0) {
      predict(belief, system.transition(k));
      if (inputs != nullptr) loop<S::n>(n, [&](int i) SUREFIX_LAMBDA { belief.x(i) += *inputs++; });
    }
    const Observation<S>& observation = system.observation(k);
    for (int i = 0; i < m; ++i) white(i) = *z++;
    observation.whiten(white);
    for (int i = 0; i < m; ++i) {
      Innovation<BeliefOf<S>> brought;
      const bool updated = Rows::with(observation, i, [&](const auto& row) SUREFIX_LAMBDA {
        const double innovation = white(i) - row.dot(belief.x);
        return update(belief, row, observation.variance(i), innovation, brought);
      });
      if (!updated) return Status::numerical;
      *kept++ = brought.value * brought.inverse;
      loop<S::n>(n, [&](int j) SUREFIX_LAMBDA { *kept++ = brought.gain(j); });
    }
  }
  typename BeliefOf<S>::Vector lambda = BeliefOf<S>::Vector::Zero(n);
  out += static_cast<std::ptrdiff_t>(T) * m;
  for (int k = T; k-- > 0;) {
    const Observation<S>& observation = system.observation(k);
    for (int i = m; i-- > 0;) {
      kept -= kept_of_each(n);
      const Gain gain(kept + 1, n);
      white(i) = 2.0 * Rows::with(observation, i, [&](const auto& row) SUREFIX_LAMBDA {
                   return desync::sweep_mean<S::n>(lambda, row, gain, 1.0, *kept);
                 });
    }
    observation.whiten_transposed(white);
    for (int i = m; i-- > 0;) *--out = white(i);
    if (k > 0) system.transition(k).apply_transposed(lambda);
  }
  return Status::ok;
}

}  // namespace surefix::drift
