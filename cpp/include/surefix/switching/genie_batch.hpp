// The genie over many series.
#pragma once

#include "surefix/core/linear_system.hpp"
#include "surefix/switching/batch_request.hpp"
#include "surefix/switching/genie.hpp"
#include "surefix/switching/mode_chain.hpp"
#include "surefix/switching/panel.hpp"

namespace surefix::switching {

/// The genie over whole series.
template <class S>
class GenieBatch {
 public:
  [[nodiscard]] ConfigStatus make(const LinearSystem& system, const std::vector<Mode>& modes) {
    modes_ = modes;
    return system_.make(system);
  }

  [[nodiscard]] BatchStatus run(const BatchRequest& in, const BatchOutput& out) const {
    using P = Pack<detail::width>;
    Genie<S> genie;
    return detail::over_runs(
        in,
        [&](std::int64_t run, int lanes) {
          int failed = 0;
          const auto take = [&](const auto* transition, const Observation<S>& observation,
                                const KnownMode<P>& mode, const Measured<S, P>& z,
                                GenieState<S, P>& state) SUREFIX_LAMBDA {
            return genie.template together<detail::width>(transition, observation, mode, z, state,
                                                          failed);
          };
          BatchStatus status = series<P>(in, out, run, lanes, take);
          if (status.status != Status::ok) status.run = run + std::min(failed, lanes - 1);
          return status;
        },
        [&](std::int64_t run) {
          const auto take =
              [&](const auto* transition, const Observation<S>& observation,
                  const KnownMode<double>& mode, const Measured<S>& z, GenieState<S, double>& state)
                  SUREFIX_LAMBDA { return genie.alone(transition, observation, mode, z, state); };
          return series<double>(in, out, run, 1, take);
        });
  }

 private:
  template <class Lane, class Take>
  SUREFIX_INLINE BatchStatus series(const BatchRequest& in, const BatchOutput& out,
                                    std::int64_t run, int lanes, Take&& take) const {
    const int m = system_.measured();
    Measured<S, Lane> z(m);
    Panel<Lane> measured(m);
    Estimates<Lane> kept(system_.size(), 0);
    GenieState<S, Lane> state;
    detail::spread(state.merged, system_.initial());
    KnownMode<Lane> mode{Lanes<Lane>::all(1.0), Lanes<Lane>::all(1.0), true};
    for (int first = 0; first < in.T; first += Panel<Lane>::depth) {
      const int count = std::min(Panel<Lane>::depth, in.T - first);
      measured.read(in.z, run, lanes, in.T, first, count);
      for (int s = 0; s < count; ++s) {
        const int k = first + s;
        if (in.modes != nullptr) know(in, run, lanes, k, mode);
        loop<S::m>(m, [&](int i) SUREFIX_LAMBDA { z(i) = measured(s, i); });
        const Status status =
            take(k > 0 ? &system_.transition(k) : nullptr, system_.observation(k), mode, z, state);
        if (status != Status::ok) return {status, run, k};
        kept.keep(s, state.merged);
      }
      int lane = 0;
      const int bad = kept.first_overflow(state.merged, count, lanes, lane);
      if (bad >= 0) return {Status::numerical, run + lane, first + bad};
      kept.x.write(out.x, run, lanes, in.T, first, count);
      kept.P.write(out.P, run, lanes, in.T, first, count);
    }
    if (out.log_likelihood != nullptr)
      for (int l = 0; l < lanes; ++l) out.log_likelihood[run + l] = state.log_likelihood(l);
    return {};
  }

  template <class Lane>
  void know(const BatchRequest& in, std::int64_t run, int lanes, int k,
            KnownMode<Lane>& mode) const noexcept {
    using L = Lanes<Lane>;
    for (int l = 0; l < L::count; ++l) {
      const std::int64_t own = run + std::min(l, lanes - 1);
      const Mode& known = modes_[static_cast<std::size_t>(in.modes[own * in.T + k])];
      L::set(mode.gamma, l, known.gamma);
      L::set(mode.delta, l, known.delta);
    }
    mode.same = L::count == 1;
  }

  PreparedSystem<S> system_;
  std::vector<Mode> modes_;
};

}  // namespace surefix::switching
