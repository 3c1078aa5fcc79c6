// A bank of modes over many series.
#pragma once

#include "surefix/core/linear_system.hpp"
#include "surefix/switching/batch_request.hpp"
#include "surefix/switching/panel.hpp"
#include "surefix/switching/recursion.hpp"

namespace surefix::switching {

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
    for (const LinearSystem& system : systems) varying_ |= system.steps() > 0;
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
                                const Measured<S, P>& z, const State<S, P>& from, State<S, P>& to)
                                SUREFIX_LAMBDA {
                                  return recursion.template together<detail::width>(
                                      step, observation, z, from, to, room, failed);
                                };
          BatchStatus status = series<P>(in, out, run, lanes, pack, take);
          if (status.status != Status::ok) status.run = run + std::min(failed, lanes - 1);
          return status;
        },
        [&](std::int64_t run) {
          const auto take =
              [&](const Step<S>& step, const Observation<S>* const* observation,
                  const Measured<S>& z, const State<S, double>& from, State<S, double>& to)
                  SUREFIX_LAMBDA { return recursion.alone(step, observation, z, from, to); };
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
    const std::size_t systems = systems_.size();
    std::vector<const Transition<S>*> transitions(systems);
    std::vector<const Observation<S>*> observations(systems);
    Measured<S, Lane> z(m);
    Panel<Lane> measured(m);
    Estimates<Lane> kept(size(), out.mode == nullptr ? 0 : M);
    start(states[0]);
    start(states[1]);
    int now = 0;
    for (int first = 0; first < in.T; first += Panel<Lane>::depth) {
      const int count = std::min(Panel<Lane>::depth, in.T - first);
      measured.read(in.z, run, lanes, in.T, first, count);
      for (int s = 0; s < count; ++s) {
        const int k = first + s;
        for (std::size_t i = 0; i < systems && (k < 2 || varying_); ++i) {
          if (k > 0) transitions[i] = &systems_[i].transition(k);
          observations[i] = &systems_[i].observation(k);
        }
        const Step<S> step{k > 0 ? transitions.data() : nullptr,
                           k > 0 ? of_step(p_, k - 1).data() : nullptr, systems > 1,
                           map_.size() > 0 ? &map_ : nullptr};
        loop<S::m>(m, [&](int i) SUREFIX_LAMBDA { z(i) = measured(s, i); });
        State<S, Lane>& to = states[at(1 - now)];
        const Status status = take(step, observations.data(), z, states[at(now)], to);
        if (status != Status::ok) return {status, run, k};
        now = 1 - now;
        kept.keep(s, to.merged);
        if (out.mode != nullptr)
          loop<S::M>(M, [&](int j) SUREFIX_LAMBDA { kept.mode(s, j) = to.law.mode[at(j)]; });
      }
      kept.x.write(out.x, run, lanes, in.T, first, count);
      kept.P.write(out.P, run, lanes, in.T, first, count);
      kept.mode.write(out.mode, run, lanes, in.T, first, count);
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
  bool varying_ = false;  // matrices differ from step to step
};

}  // namespace surefix::switching
