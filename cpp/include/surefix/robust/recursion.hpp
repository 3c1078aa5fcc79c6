// One step of the mixture: from the components before it, over all hypotheses, to the components
// after it.
#pragma once

#include <limits>

#include "surefix/robust/hypothesis_pack.hpp"
#include "surefix/robust/measurement_tree.hpp"
#include "surefix/robust/merge.hpp"
#include "surefix/robust/mode_prior.hpp"
#include "surefix/robust/reduction.hpp"

namespace surefix::robust {

/// How much of the mixture lives from step to step.
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
  double memory = 1.0;  ///< how long mass that was cut stays in the risk [s], > 0: see `discarded`

  [[nodiscard]] ConfigStatus check() const noexcept {
    if (components < 1 || !(memory > 0.0)) return ConfigStatus::not_positive;
    if (!(cut >= 0.0)) return ConfigStatus::negative;
    return cut < 1.0 ? ConfigStatus::ok : ConfigStatus::risk;
  }
};

/// Hypotheses per measurement, in place of those per sensor: each measurement is healthy or an
/// outlier on its own.
struct PerMeasurement {
  std::size_t capacity = 0;         ///< hypotheses at a time, a multiple of 4, ≥ 8; 0: per sensor
  std::vector<OutlierPrior> prior;  ///< of every sensor
};

/// All that changes while a mixture is carried: a plain value.
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
        pack_(system) {
    const auto R = static_cast<std::size_t>(table.count());
    const bool one = carry.kind == Carry::Kind::one_gaussian;
    const std::size_t K = one ? 1 : static_cast<std::size_t>(carry.components);
    const bool tree = per_measurement.capacity > 0;
    const std::size_t branches = tree ? per_measurement.capacity : std::min(K * R, max_branches);
    if (tree) tree_ = MeasurementTree<Base>(system.base(), branches);
    const int n = system.state_size();
    state_.components = Components(n, K);
    hypotheses_ = next_ = Components(n, branches);
    source_.resize(branches);
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
    if (room > plan_.capacity() || plan_.capacity() == 0)
      plan_ = StepPlan<FaultSystem>(system_, room);
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
    status = per_measurement_.capacity > 0 ? grow(cut_before) : run_branches(cut_before);
    if (status != Status::ok) return status;
    const double evidence = normalise(next_);
    if (!(std::abs(evidence) <= std::numeric_limits<double>::max())) return Status::numerical;

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
  void restore(const MixtureState& state) { state_ = state; }
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
  /// Per measurement: adds to `lost` the mass that the tree had no room for.
  [[nodiscard]] Status grow(double& lost) noexcept {
    if (plan_.count() > 64) return Status::buffer_full;
    tree_.start(state_.components);
    for (std::size_t i = 0; i < plan_.count(); ++i) {
      const Measurement& m = plan_.measurement(i);
      const OutlierPrior& prior = per_measurement_.prior[static_cast<std::size_t>(m.sensor)];
      if (!tree_.grow(system_.base(), plan_.leg(i), m, static_cast<int>(i), prior, lost))
        return Status::numerical;
    }
    tree_.move(plan_.leg(plan_.count()));
    tree_.store(next_);
    return Status::ok;
  }

  /// Per sensor: adds to `lost` the prior mass of what was not run.
  [[nodiscard]] Status run_branches(double& lost) noexcept {
    lost += branch();
    return evaluate();
  }

  /// Every component under every hypothesis that its mode and the prior leave possible, with the
  /// prior log-weight, into `next_`. Returns the mass of those not worth running.
  double branch() noexcept {
    const int R = table_.count();
    const double total = static_cast<double>(state_.components.count()) * R;
    const double worth =
        carry_.cut > 0.0 ? std::log(carry_.cut / total) : -std::numeric_limits<double>::infinity();
    double lost = 0.0;
    std::size_t count = 0;
    const bool carried = carry_.kind != Carry::Kind::one_gaussian || state_.first;
    for (std::size_t c = 0; c < state_.components.count(); ++c) {
      double possible = 0.0;
      for (int h = 0; h < R; ++h) {
        const double log_weight =
            state_.components.log_weight(c) +
            (carried ? prior_.log_probability(table_, state_.components.hypothesis(c), h)
                     : log_prior_of_modes(h));
        const double weight = std::exp(log_weight);
        possible += weight;
        if (!(log_weight > worth) || count == next_.capacity()) {
          lost += weight;
          continue;
        }
        next_.log_weight(count) = log_weight;
        next_.hypothesis(count) = h;
        source_[count++] = static_cast<int>(c);
      }
      if (!table_.complete())  // more faults at once than the table has
        lost += std::max(std::exp(state_.components.log_weight(c)) - possible, 0.0);
    }
    next_.resize(count);
    return lost;
  }

  /// log Σ_a p(a | past) p(h | a) for the one Gaussian.
  [[nodiscard]] double log_prior_of_modes(int h) const noexcept {
    double sum = 0.0;
    for (int a = 0; a < table_.count(); ++a) {
      const double p = state_.mode[static_cast<std::size_t>(a)];
      if (p > 0.0) sum += p * std::exp(prior_.log_probability(table_, a, h));
    }
    return std::log(sum);
  }

  [[nodiscard]] Status evaluate() noexcept {
    constexpr std::size_t lanes = HypothesisPack<FaultSystem>::lanes;
    const std::size_t count = next_.count();
    for (std::size_t first = 0; first < count; first += lanes) {
      for (std::size_t l = 0; l < lanes; ++l) {
        const std::size_t b = std::min(first + l, count - 1);  // the last one fills the pack
        pack_.load(system_, table_, static_cast<int>(l), state_.components,
                   static_cast<std::size_t>(source_[b]), next_.hypothesis(b));
      }
      const Status status = pack_.run(system_, plan_);
      if (status != Status::ok) return status;
      for (std::size_t l = 0; l < lanes && first + l < count; ++l)
        pack_.store(system_, table_, plan_, static_cast<int>(l), next_, first + l);
    }
    return Status::ok;
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
  static constexpr std::size_t max_branches = 1 << 15;

  FaultSystem system_;
  ModeTable table_;
  ModePrior prior_;
  Carry carry_;
  PerMeasurement per_measurement_;
  HypothesisPack<FaultSystem> pack_;
  MeasurementTree<Base> tree_;
  StepPlan<FaultSystem> plan_;
  MixtureState state_;
  Components hypotheses_, next_, merged_;
  Merger merger_;
  std::vector<int> source_, order_;
  std::vector<double> x_, P_;
};

}  // namespace surefix::robust
