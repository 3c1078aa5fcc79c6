// Many series of one length through one filter: packs of eight side by side, time outermost.
#pragma once

#include <cstdint>
#include <limits>

#include "surefix/switching/genie.hpp"
#include "surefix/switching/linear_system.hpp"
#include "surefix/switching/recursion.hpp"

namespace surefix::switching {

/// Series `first` to `last` − 1 of arrays in C order.
struct BatchRequest {
  const double* z;            ///< (runs, T, m), NaN: missing
  const std::int32_t* modes;  ///< (runs, T) of a genie that knows them; null: all healthy
  std::int64_t first, last;
  int T;
};

/// Where a batch writes; null: not wanted.
struct BatchOutput {
  double* x;               ///< (runs, T, n)
  double* P;               ///< (runs, T, n, n)
  double* mode;            ///< (runs, T, M)
  double* log_likelihood;  ///< (runs)
};

/// How it went: a status, and the run and step at which it is not ok.
struct BatchStatus {
  Status status = Status::ok;
  std::int64_t run = -1;
  int step = -1;
};

namespace detail {

inline constexpr int width = 8;  // series in a pack

/// Component i of z of a step, of series `run` and those after it; beyond the last one it again.
template <class S, class Lane>
SUREFIX_INLINE void gather(const BatchRequest& in, std::int64_t run, int k, int m,
                           Measured<S, Lane>& z) noexcept {
  using L = Lanes<Lane>;
  loop<S::m>(m, [&](int i) SUREFIX_LAMBDA {
    for (int l = 0; l < L::count; ++l) {
      const std::int64_t own = run + l < in.last ? run + l : in.last - 1;
      L::set(z(i), l, in.z[(own * in.T + k) * m + i]);
    }
  });
}

/// An estimate of a step into the arrays of the series.
template <class S, class Lane>
SUREFIX_INLINE void scatter(const Belief<S, Lane>& belief, const BatchRequest& in,
                            std::int64_t run, int lanes, int k, const BatchOutput& out) noexcept {
  using L = Lanes<Lane>;
  const int n = belief.size();
  loop<S::n>(n, [&](int a) SUREFIX_LAMBDA {
    for (int l = 0; l < lanes; ++l)
      out.x[((run + l) * in.T + k) * n + a] = L::get(belief.x(a), l);
  });
  if (out.P == nullptr) return;
  loop<S::n>(n, [&](int a) SUREFIX_LAMBDA {
    loop<S::n>(n, [&](int b) SUREFIX_LAMBDA {
      for (int l = 0; l < lanes; ++l)
        out.P[(((run + l) * in.T + k) * n + a) * n + b] = L::get(belief.P(a, b), l);
    });
  });
}

/// All lanes of `to` ← the same belief.
template <class To, class From>
void spread(To& to, const From& from) noexcept {
  for (int l = 0; l < Lanes<typename To::Scalar>::count; ++l) copy_lane(to, l, from, 0);
}

/// Packs of the range, then what remains of it: alone, or as a pack that is not full.
template <class Together, class Alone>
BatchStatus over_runs(const BatchRequest& in, Together&& together, Alone&& alone) {
  std::int64_t run = in.first;
  BatchStatus status;
  for (; in.last - run >= 3 && status.status == Status::ok; run += width)
    status = together(run, static_cast<int>(std::min<std::int64_t>(width, in.last - run)));
  for (; run < in.last && status.status == Status::ok; ++run) status = alone(run);
  return status;
}

}  // namespace detail

/// A bank of modes (one-step or IMM) over whole series.
template <class S>
class BankBatch {
 public:
  /// One system, or one for every mode with its `map`; `p` one matrix for all steps, or one for
  /// each but the first. All have been checked to fit each other in number.
  [[nodiscard]] ConfigStatus make(const std::vector<LinearSystem>& systems, const ModeChain& chain,
                                  const std::vector<Eigen::MatrixXd>& p, const StateMap& map) {
    systems_.resize(systems.size());
    for (std::size_t s = 0; s < systems.size(); ++s)
      if (const auto status = systems_[s].make(systems[s]); status != ConfigStatus::ok)
        return status;
    map_ = map;
    initial_ = chain.initial;
    const ConfigStatus status = modes_.make(chain, systems.front().measured());
    const int M = chain.size();
    for (const Eigen::MatrixXd& P : p) {
      p_.emplace_back();
      for (int i = 0; i < M; ++i)
        for (int j = 0; j < M; ++j) {
          p_.back().push_back(P(i, j));
          if (P(i, j) > 0.0) modes_.allow(j);
        }
    }
    return status;
  }

  /// States of the estimate.
  [[nodiscard]] int size() const noexcept {
    return map_.size() > 0 ? map_.size() : systems_.front().size();
  }

  template <Method method>
  [[nodiscard]] BatchStatus run(const BatchRequest& in, const BatchOutput& out) const {
    using P = Pack<detail::width>;
    Recursion<method, S> recursion(modes_, static_cast<int>(systems_.size()));
    std::array<State<S, P>, 2> pack;
    std::array<State<S, double>, 2> single;
    for (auto& state : pack) state.make(modes_.size());
    for (auto& state : single) state.make(modes_.size());
    Workspace<S, P> room;
    room.make(modes_.size());
    return detail::over_runs(
        in,
        [&](std::int64_t run, int lanes) {
          int failed = 0;
          const auto take = [&](const Step<S>& step, const Observation<S>* const* observation,
                                const Measured<S, P>& z, const State<S, P>& from,
                                State<S, P>& to) SUREFIX_LAMBDA {
            return recursion.template together<detail::width>(step, observation, z, from, to, room,
                                                              failed);
          };
          BatchStatus status = series<P>(in, out, run, lanes, pack, take);
          if (status.status != Status::ok) status.run = run + std::min(failed, lanes - 1);
          return status;
        },
        [&](std::int64_t run) {
          const auto take = [&](const Step<S>& step, const Observation<S>* const* observation,
                                const Measured<S>& z, const State<S, double>& from,
                                State<S, double>& to) SUREFIX_LAMBDA {
            return recursion.alone(step, observation, z, from, to);
          };
          BatchStatus status = series<double>(in, out, run, 1, single, take);
          if (status.status != Status::ok) status.run = run;
          return status;
        });
  }

 private:
  template <class Lane>
  void start(State<S, Lane>& state) const {
    for (int j = 0; j < modes_.size(); ++j) {
      detail::spread(state.bank[at(j)], system(j).initial());
      state.law.mode[at(j)] = Lanes<Lane>::all(initial_(j));
    }
    state.law.deep = Lanes<Lane>::all(0.0);
    state.evidence = {};
    const int n = size();
    if constexpr (S::n == Eigen::Dynamic) {
      state.merged.x.resize(n);
      state.merged.P.resize(n, n);
    }
    state.merged.x.setConstant(Lanes<Lane>::all(0.0));
    state.merged.P.setConstant(Lanes<Lane>::all(0.0));
  }

  /// All steps of the series that the lane holds.
  template <class Lane, class Take>
  BatchStatus series(const BatchRequest& in, const BatchOutput& out, std::int64_t run, int lanes,
                     std::array<State<S, Lane>, 2>& states, Take&& take) const {
    const int m = systems_.front().measured(), M = modes_.size();
    const std::size_t count = systems_.size();
    std::vector<const Transition<S>*> transitions(count);
    std::vector<const Observation<S>*> observations(count);
    Measured<S, Lane> z(m);
    start(states[0]);
    start(states[1]);
    int now = 0;
    for (int k = 0; k < in.T; ++k) {
      for (std::size_t s = 0; s < count; ++s) {
        if (k > 0) transitions[s] = &systems_[s].transition(k);
        observations[s] = &systems_[s].observation(k);
      }
      const Step<S> step{k > 0 ? transitions.data() : nullptr,
                         k > 0 ? of_step(p_, k - 1).data() : nullptr, count > 1,
                         map_.size() > 0 ? &map_ : nullptr};
      detail::gather<S, Lane>(in, run, k, m, z);
      State<S, Lane>& to = states[at(1 - now)];
      const Status status = take(step, observations.data(), z, states[at(now)], to);
      if (status != Status::ok) return {status, run, k};
      now = 1 - now;
      detail::scatter<S>(to.merged, in, run, lanes, k, out);
      if (out.mode == nullptr) continue;
      for (int j = 0; j < M; ++j)
        for (int l = 0; l < lanes; ++l)
          out.mode[((run + l) * in.T + k) * M + j] = Lanes<Lane>::get(to.law.mode[at(j)], l);
    }
    if (out.log_likelihood != nullptr)
      for (int l = 0; l < lanes; ++l)
        out.log_likelihood[run + l] = states[at(now)].evidence.log_likelihood(l);
    return {};
  }

  [[nodiscard]] const PreparedSystem<S>& system(int mode) const noexcept {
    return systems_[systems_.size() > 1 ? at(mode) : 0];
  }

  std::vector<PreparedSystem<S>> systems_;
  ModeTable<S> modes_;
  Eigen::VectorXd initial_;
  std::vector<std::vector<double>> p_;
  StateMap map_;
};

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
          const auto take = [&](const auto* transition, const Observation<S>& observation,
                                const KnownMode<double>& mode, const Measured<S>& z,
                                GenieState<S, double>& state) SUREFIX_LAMBDA {
            return genie.alone(transition, observation, mode, z, state);
          };
          return series<double>(in, out, run, 1, take);
        });
  }

 private:
  template <class Lane, class Take>
  SUREFIX_INLINE BatchStatus series(const BatchRequest& in, const BatchOutput& out,
                                    std::int64_t run, int lanes, Take&& take) const {
    const int m = system_.measured();
    Measured<S, Lane> z(m);
    GenieState<S, Lane> state;
    detail::spread(state.merged, system_.initial());
    KnownMode<Lane> mode{Lanes<Lane>::all(1.0), Lanes<Lane>::all(1.0), true};
    for (int k = 0; k < in.T; ++k) {
      if (in.modes != nullptr) know(in, run, k, mode);
      detail::gather<S, Lane>(in, run, k, m, z);
      const Status status = take(k > 0 ? &system_.transition(k) : nullptr, system_.observation(k),
                                 mode, z, state);
      if (status != Status::ok) return {status, run, k};
      detail::scatter<S>(state.merged, in, run, lanes, k, out);
    }
    if (out.log_likelihood != nullptr)
      for (int l = 0; l < lanes; ++l) out.log_likelihood[run + l] = state.log_likelihood(l);
    return {};
  }

  template <class Lane>
  void know(const BatchRequest& in, std::int64_t run, int k, KnownMode<Lane>& mode) const noexcept {
    using L = Lanes<Lane>;
    for (int l = 0; l < L::count; ++l) {
      const std::int64_t own = run + l < in.last ? run + l : in.last - 1;
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
