// Four hypotheses of one step side by side: they share the legs and the rows, and differ in where
// they start, in the noise variance of every sensor and in which biases wander.
#pragma once

#include "surefix/core/predict.hpp"
#include "surefix/core/update.hpp"
#include "surefix/robust/components.hpp"
#include "surefix/robust/step_plan.hpp"

namespace surefix::robust {

template <class FaultSystem>
class HypothesisPack {
 public:
  static constexpr int lanes = 4;
  using Lane = Pack<lanes>;
  using Belief = Gaussian<FaultSystem::size, Lane, FaultSystem::max_size>;

  HypothesisPack() = default;
  explicit HypothesisPack(const FaultSystem& system)
      : variance_(static_cast<std::size_t>(system.sensor_count())),
        used_(variance_.size()),
        scale_(variance_.size()),
        walk_(variance_.size()) {
    belief_.x.resize(system.state_size());
    belief_.P.resize(system.state_size(), system.state_size());
  }

  /// Lane `l` starts from component `c` of `from` under hypothesis `h` of the table: a bias begins
  /// with its sensor's fault, goes on while that lasts and is gone after it.
  void load(const FaultSystem& system, const ModeTable& table, int l, const Components& from,
            std::size_t c, int h) noexcept {
    const int n = system.state_size(), before = from.hypothesis(c);
    for (int j = 0; j < n; ++j) {
      belief_.x(j)(l) = from.x(c)[j];
      for (int i = 0; i < n; ++i) belief_.P(i, j)(l) = from.P(c)[j * n + i];
    }
    for (int s = 0; s < system.sensor_count(); ++s) {
      const auto k = static_cast<std::size_t>(s);
      const int mode = table.mode(h, s);
      variance_[k](l) = system.variance(s, mode);
      const bool removed = system.modes(s)[mode].removes_rows();
      used_[k](l) = removed ? 0.0 : 1.0;
      scale_[k](l) = removed ? 1.0 / removed_variance : 1.0;  // so that log S counts for nothing
      walk_[k](l) = 0.0;
      const int bias = system.drift_state(s), drifting = system.modes(s).drifting();
      if (bias < 0) continue;
      const bool drifts = mode == drifting, drifted = table.mode(before, s) == drifting;
      const FaultMode& fault = system.modes(s)[drifting];
      if (drifts) walk_[k](l) = fault.walk * fault.walk;
      if (!drifts || !drifted) begin(l, bias, drifts ? fault.sigma * fault.sigma : 0.0);
    }
  }

  /// Takes all measurements of the step.
  [[nodiscard]] Status run(const FaultSystem& system, const StepPlan<FaultSystem>& plan) noexcept {
    return run(system, plan, [](std::size_t, const auto&, const auto&) SUREFIX_LAMBDA {});
  }
  /// The same, and calls `visit(i, linearisation, innovation)` for each.
  template <class Visit>
  [[nodiscard]] SUREFIX_INLINE Status run(const FaultSystem& system,
                                          const StepPlan<FaultSystem>& plan,
                                          Visit&& visit) noexcept {
    squares_ = Lane(0.0);
    log_determinant_ = Lane(0.0);
    product_ = Lane(1.0);
    for (std::size_t i = 0; i < plan.count(); ++i) {
      move(system, plan.leg(i));
      if (!absorb(system, plan.measurement(i), i, visit)) return Status::numerical;
    }
    move(system, plan.leg(plan.count()));
    set_aside();
    return Status::ok;
  }

  /// Lane `l` as component `c`: log-density of its measurements added to the log-weight there. A
  /// hypothesis that overflowed has the log-weight −∞.
  void store(const FaultSystem& system, const ModeTable& table, const StepPlan<FaultSystem>& plan,
             int l, Components& to, std::size_t c) const noexcept {
    const int n = system.state_size();
    double sum = 0.0;
    for (int j = 0; j < n; ++j) {
      sum += to.x(c)[j] = belief_.x(j)(l);
      for (int i = 0; i < n; ++i) sum += to.P(c)[j * n + i] = belief_.P(i, j)(l);
    }
    double log_density = -0.5 * (squares_(l) + log_determinant_(l));
    for (int s = 0; s < system.sensor_count(); ++s)
      log_density += plan.log_density(s, table.mode(to.hypothesis(c), s));
    const bool finite = sum * 0.0 == 0.0 && log_density * 0.0 == 0.0;
    to.log_weight(c) += finite ? log_density : -std::numeric_limits<double>::infinity();
    to.squares(c) = squares_(l);
  }

 private:
  void begin(int l, int bias, double variance) noexcept {
    belief_.x(bias)(l) = 0.0;
    for (int i = 0; i < belief_.size(); ++i) belief_.P(i, bias)(l) = belief_.P(bias, i)(l) = 0.0;
    belief_.P(bias, bias)(l) = variance;
  }

  void move(const FaultSystem& system, const typename StepPlan<FaultSystem>::Leg& leg) noexcept {
    if (leg.elapsed == 0) return;
    predict(belief_, leg.transition);
    for (int s = 0; s < system.sensor_count(); ++s) {
      const int bias = system.drift_state(s);
      if (bias >= 0)
        belief_.P(bias, bias) += walk_[static_cast<std::size_t>(s)] * seconds(leg.elapsed);
    }
  }

  template <class Visit>
  [[nodiscard]] SUREFIX_INLINE bool absorb(const FaultSystem& system, const Measurement& m,
                                           std::size_t i, Visit& visit) noexcept {
    const auto s = static_cast<std::size_t>(m.sensor);
    auto reading = system.read(m.sensor, belief_.x);
    Lane innovation = m.value - reading.predicted;
    Innovation<Belief> out;
    Lane variance = variance_[s];
    if (m.factor != 1.0)  // of what is not removed
      variance *= used_[s] * (m.factor * m.factor) + (1.0 - used_[s]);
    const auto try_update = [&] {
      return system.with_row(m.sensor, reading.at, [&](const auto& row) SUREFIX_LAMBDA {
        return update(belief_, row, variance, innovation, out);
      });
    };
    if (!try_update()) {
      bury();
      reading = system.read(m.sensor, belief_.x);
      innovation = m.value - reading.predicted;
      if (!try_update()) return false;
    }
    visit(i, reading.at, out);
    squares_ += used_[s] * (innovation.square() / out.variance);
    const Lane before = product_, factor = out.variance * scale_[s];
    product_ *= factor;
    if (within(product_, 1e-100, 1e100)) return true;
    log_determinant_ += before.log() + factor.log();  // their product may be no normal number
    product_ = Lane(1.0);
    return true;
  }

  /// A hypothesis that took a gross value for a healthy one may have overflowed: it is impossible,
  /// and must not stop those beside it.
  void bury() noexcept {
    for (Eigen::Index l = 0; l < lanes; ++l) {
      double sum = 0.0;
      for (int j = 0; j < belief_.size(); ++j)
        sum += std::abs(belief_.x(j)(l)) + std::abs(belief_.P(j, j)(l));
      if (sum <= largest_value) continue;
      squares_(l) = std::numeric_limits<double>::infinity();
      for (int j = 0; j < belief_.size(); ++j) {
        belief_.x(j)(l) = 0.0;
        for (int i = 0; i < belief_.size(); ++i) belief_.P(i, j)(l) = 0.0;
      }
    }
  }

  void set_aside() noexcept {
    log_determinant_ += product_.log();
    product_ = Lane(1.0);
  }

  Belief belief_;
  std::vector<Lane> variance_, used_, scale_, walk_;  // of every sensor
  Lane squares_ = Lane(0.0), log_determinant_ = Lane(0.0), product_ = Lane(1.0);
};

}  // namespace surefix::robust
