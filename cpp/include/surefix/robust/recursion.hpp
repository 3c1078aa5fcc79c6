// One step of the mixture: from the components before it, over all hypotheses, to the components
// after it.
#pragma once

#include <algorithm>
#include <limits>

#include "surefix/robust/branches.hpp"
#include "surefix/robust/carry.hpp"
#include "surefix/robust/measurement_tree.hpp"
#include "surefix/robust/merge.hpp"
#include "surefix/robust/reduction.hpp"
#include "surefix/robust/step_noise.hpp"

namespace surefix::robust {

template <class FaultSystem>
class Recursion {
 public:
  using Base = typename FaultSystem::Base;

  Recursion(const FaultSystem& system, const ModeTable& table, const ModePrior& prior,
            const Carry& carry, const PerMeasurement& per_measurement, std::size_t max_measurements)
      : system_(system),
        table_(table),
        prior_(prior),
        carry_(carry),
        per_measurement_(per_measurement),
        branches_(system, room(table, carry, per_measurement)),
        noise_(system) {
    const auto R = static_cast<std::size_t>(table.count());
    const bool one = carry.kind == Carry::Kind::one_gaussian;
    const std::size_t K = one ? 1 : static_cast<std::size_t>(carry.components);
    const std::size_t branches = room(table, carry, per_measurement);
    if (per_measurement.capacity > 0) tree_ = MeasurementTree<Base>(system.base(), branches);
    const int n = system.state_size();
    state_.components = Components(n, K);
    hypotheses_ = next_ = Components(n, branches);
    order_.resize(std::max(branches, K + R));
    state_.mode.assign(R, 0.0);
    x_.resize(static_cast<std::size_t>(n));
    P_.resize(static_cast<std::size_t>(n * n));
    state_.last.resize(static_cast<std::size_t>(system.sensor_count()));
    if (carry.kind == Carry::Kind::merge) {
      merged_ = Components(n, K + R);
      merger_ = Merger(n, table.count(), branches, [&](int h, int i) { return active(h, i); });
    }
    reserve(max_measurements);
  }

  /// Room for steps of so many measurements.
  void reserve(std::size_t max_measurements) {
    const std::size_t room = std::min(max_measurements, most_measurements);
    if (room <= plan_.capacity() && plan_.capacity() != 0) return;
    plan_ = StepPlan<FaultSystem>(system_, room);
    if (noisy_) noise_.reserve(room);
  }

  /// From now on every step estimates the noise of its measurements under its most probable
  /// hypothesis; not for hypotheses per measurement.
  void estimate_noise() {
    noisy_ = !per_measurement();
    noise_.reserve(plan_.capacity());
    mass_.resize(static_cast<std::size_t>(table_.count()));
  }

  /// Starts at `time` from one Gaussian over the base system's states, nothing known of the modes.
  void start(const typename Base::Belief& belief, Time time) noexcept {
    const int n = system_.base_size(), m = system_.state_size();
    state_.components.resize(1);
    state_.components.log_weight(0) = 0.0;
    state_.components.hypothesis(0) = 0;
    std::fill(state_.components.x(0), state_.components.x(0) + m, 0.0);
    std::fill(state_.components.P(0), state_.components.P(0) + m * m, 0.0);
    for (int j = 0; j < n; ++j) {
      state_.components.x(0)[j] = belief.x(j);
      for (int i = 0; i < n; ++i) state_.components.P(0)[j * m + i] = belief.P(i, j);
    }
    state_.time = time;
    state_.first = true;
    state_.discarded = state_.cut_last = 0.0;
    state_.log_likelihood = 0.0;
    std::fill(state_.last.begin(), state_.last.end(), LastValue{});
  }

  /// A step over `count` measurements, in order of validity from `time()` on, that ends at `to`.
  /// On any status but ok nothing changes.
  [[nodiscard]] Status advance(const Measurement* measurements, std::size_t count,
                               Time to) noexcept {
    if (count > plan_.capacity()) return Status::buffer_full;
    Status status = plan_.make(system_, measurements, count, state_.time, to, state_.last);
    if (status != Status::ok) return status;
    const double dt = seconds(to - state_.time);
    prior_.advance(dt, state_.first);
    double cut_before = 0.0;
    status = per_measurement_.capacity > 0 ? grow() : run_branches(cut_before);
    if (status != Status::ok) return status;
    const double evidence = normalise(next_);
    if (!(std::abs(evidence) <= std::numeric_limits<double>::max())) return Status::numerical;
    if (per_measurement())  // L / (E + L)
      cut_before += 1.0 / (1.0 + std::exp(evidence - tree_.log_lost()));

    if (noisy_) {
      const std::size_t best = most_probable(next_, mass_);
      status = noise_.run(system_, table_, plan_, state_.components, branches_.source(best),
                          next_.hypothesis(best));
      if (status != Status::ok) return status;
    }
    std::swap(hypotheses_, next_);
    state_.discarded =
        (state_.discarded + state_.cut_last) * std::exp(-dt / carry_.memory) + cut_before;
    state_.cut_last = reduce();
    state_.log_likelihood += evidence;
    std::copy(plan_.last().begin(), plan_.last().end(), state_.last.begin());
    state_.time = to;
    state_.first = false;
    return Status::ok;
  }

  [[nodiscard]] const FaultSystem& system() const noexcept { return system_; }
  [[nodiscard]] const ModeTable& table() const noexcept { return table_; }
  [[nodiscard]] const MixtureState& state() const noexcept { return state_; }
  /// Goes on from a saved state of a recursion made from the same.
  void restore(const MixtureState& state) {
    state_ = state;
    hypotheses_.resize(0);  // those of the last step are not saved
  }
  [[nodiscard]] Time time() const noexcept { return state_.time; }
  [[nodiscard]] double log_likelihood() const noexcept { return state_.log_likelihood; }
  /// Of the i-th measurement of the last step: ok, or why it was not used.
  [[nodiscard]] Status status(std::size_t i) const noexcept { return plan_.status(i); }
  /// All hypotheses of the last step, weights normalised.
  [[nodiscard]] const Components& hypotheses() const noexcept { return hypotheses_; }
  /// Number of measurements of the last step that component c of `hypotheses` did not remove.
  [[nodiscard]] std::int32_t degrees(std::size_t c) const noexcept {
    std::int32_t degrees = 0;
    if (per_measurement_.capacity > 0) {
      for (std::size_t i = 0; i < plan_.count(); ++i) degrees += (tree_.faults(c) >> i & 1) == 0;
      return degrees;
    }
    const int h = hypotheses_.hypothesis(c);
    for (int s = 0; s < system_.sensor_count(); ++s)
      if (!system_.modes(s)[table_.mode(h, s)].removes_rows()) degrees += plan_.readings(s);
    return degrees;
  }
  /// Posterior probability that the i-th used measurement of the last step is an outlier, for
  /// hypotheses per measurement.
  [[nodiscard]] double outlier(std::size_t i) const noexcept {
    double sum = 0.0;
    for (std::size_t c = 0; c < hypotheses_.count(); ++c)
      if ((tree_.faults(c) >> i & 1) != 0) sum += std::exp(hypotheses_.log_weight(c));
    return sum;
  }
  /// Noise of the i-th used measurement of the last step, once `estimate_noise` was called.
  [[nodiscard]] typename StepNoise<FaultSystem>::Value noise(std::size_t i) const noexcept {
    return noise_[i];
  }
  [[nodiscard]] bool estimates_noise() const noexcept { return noisy_; }
  [[nodiscard]] bool per_measurement() const noexcept { return per_measurement_.capacity > 0; }
  /// What goes on to the next step.
  [[nodiscard]] const Components& components() const noexcept { return state_.components; }
  /// Probability that the truth is among what was cut off: prior mass of the hypotheses of the last
  /// step that were not run, and posterior mass cut off after earlier steps. Under the model the
  /// posterior probability of a set of mode histories is a martingale, so what was cut keeps its
  /// probability in the mean; it is forgotten over `Carry::memory`, after which the faults that set
  /// those histories apart have ended.
  [[nodiscard]] double discarded() const noexcept { return state_.discarded; }

 private:
  /// How many hypotheses a step may have.
  static std::size_t room(const ModeTable& table, const Carry& carry,
                          const PerMeasurement& per_measurement) noexcept {
    if (per_measurement.capacity > 0) return per_measurement.capacity;
    const bool one = carry.kind == Carry::Kind::one_gaussian;
    const auto K = static_cast<std::size_t>(one ? 1 : carry.components);
    return std::min(K * static_cast<std::size_t>(table.count()), Branches<FaultSystem>::most);
  }

  /// Per measurement. Only what the limit on outliers forbids and what there is no room for goes on
  /// the way; what is not worth carrying goes at the end, where its weight is known.
  [[nodiscard]] Status grow() noexcept {
    const std::size_t N = plan_.count();
    if (N > PerMeasurement::max_measurements) return Status::buffer_full;
    tree_.start(state_.components);
    for (std::size_t i = 0; i < N; ++i) {
      const Measurement& m = plan_.measurement(i);
      const OutlierPrior& prior = per_measurement_.prior[static_cast<std::size_t>(m.sensor)];
      if (!tree_.grow(system_.base(), plan_.leg(i), m, static_cast<int>(i), prior))
        return Status::numerical;
      if (static_cast<int>(i) >= per_measurement_.max_outliers)
        tree_.prune({0.0, per_measurement_.max_outliers});
    }
    if (carry_.cut > 0.0) tree_.prune({carry_.cut / static_cast<double>(tree_.count())});
    tree_.finish(plan_.leg(N), next_);
    return Status::ok;
  }
  /// Per sensor: adds to `lost` the prior mass of what was not run.
  [[nodiscard]] Status run_branches(double& lost) noexcept {
    const double total = static_cast<double>(state_.components.count()) * table_.count();
    const bool carried = carry_.kind != Carry::Kind::one_gaussian || state_.first;
    lost += branches_.make(table_, prior_, state_, carried, std::log(carry_.cut / total), next_);
    return branches_.run(system_, table_, plan_, state_.components, next_);
  }

  /// Makes the components of the next step; returns the mass cut off.
  [[nodiscard]] double reduce() noexcept {
    if (carry_.kind == Carry::Kind::cut)
      return keep_heaviest(hypotheses_, carry_.cut, order_, state_.components);
    if (carry_.kind == Carry::Kind::merge) {
      merger_.merge(hypotheses_, std::max(carry_.components / table_.count(), 1), merged_);
      return keep_heaviest(merged_, carry_.cut, order_, state_.components);
    }
    std::fill(state_.mode.begin(), state_.mode.end(), 0.0);
    for (std::size_t c = 0; c < hypotheses_.count(); ++c)
      state_.mode[static_cast<std::size_t>(hypotheses_.hypothesis(c))] +=
          std::exp(hypotheses_.log_weight(c));
    keep_moments(hypotheses_, system_.base_size(), x_.data(), P_.data(), state_.components);
    return 0.0;
  }

  /// Whether state i has a variance in hypothesis h: all but the biases of sensors that do not
  /// drift.
  [[nodiscard]] bool active(int h, int i) const noexcept {
    for (int s = 0; s < system_.sensor_count(); ++s)
      if (system_.drift_state(s) == i) return table_.mode(h, s) == system_.modes(s).drifting();
    return true;
  }

  static constexpr std::size_t most_measurements = std::size_t{1} << 24;

  FaultSystem system_;
  ModeTable table_;
  ModePrior prior_;
  Carry carry_;
  PerMeasurement per_measurement_;
  Branches<FaultSystem> branches_;
  StepNoise<FaultSystem> noise_;
  bool noisy_ = false;
  MeasurementTree<Base> tree_;
  StepPlan<FaultSystem> plan_;
  MixtureState state_;
  Components hypotheses_, next_, merged_;
  Merger merger_;
  std::vector<int> order_;
  std::vector<double> x_, P_, mass_;
};

}  // namespace surefix::robust
