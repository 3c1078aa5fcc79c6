// The estimate of the measurement noise (Bilenne 2004, eqs. 25, 26) of one step under one of its
// hypotheses: v̂ = Υ Γ⁻¹ γ with the hypothesis's own Υ and H.
#pragma once

#include <limits>
#include <vector>

#include "surefix/desync/backward_sweep.hpp"
#include "surefix/robust/hypothesis_pack.hpp"

namespace surefix::robust {

template <class FaultSystem>
class StepNoise {
  using Pack = HypothesisPack<FaultSystem>;
  using Belief = Gaussian<FaultSystem::size, double, FaultSystem::max_size>;

 public:
  /// v̂ and its variance; NaN where the hypothesis removes the measurement.
  struct Value {
    double noise;
    double variance;
  };

  explicit StepNoise(const FaultSystem& system) : pack_(system) {}

  /// Room for steps of so many measurements.
  void reserve(std::size_t max_measurements) {
    records_.resize(max_measurements);
    values_.resize(max_measurements);
  }

  /// Of component `c` of `from` under hypothesis `h`, over the step of `plan`.
  [[nodiscard]] Status run(const FaultSystem& system, const ModeTable& table,
                           const StepPlan<FaultSystem>& plan, const Components& from, std::size_t c,
                           int h) noexcept {
    for (int l = 0; l < Pack::lanes; ++l) pack_.load(system, table, l, from, c, h);
    const Status status =
        pack_.run(system, plan, [&](std::size_t i, const auto& at, const auto& innovation) {
          Record& record = records_[i];
          record.at = {first(at.gain), first(at.level)};
          record.innovation.value = first(innovation.value);
          record.innovation.variance = first(innovation.variance);
          const int n = system.state_size();
          record.innovation.gain.resize(n);
          for (int j = 0; j < n; ++j) record.innovation.gain(j) = first(innovation.gain(j));
        });
    if (status == Status::ok) sweep(system, table, plan, h);
    return status;
  }

  /// Of the i-th used measurement.
  [[nodiscard]] Value operator[](std::size_t i) const noexcept { return values_[i]; }

 private:
  struct Record {
    Linearisation at;
    Innovation<Belief> innovation;
  };
  static double first(double value) noexcept { return value; }
  template <class Lane>
  static double first(const Lane& value) noexcept {
    return value(0);
  }

  void sweep(const FaultSystem& system, const ModeTable& table, const StepPlan<FaultSystem>& plan,
             int h) noexcept {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    auto adjoint = desync::Adjoint<Belief>::zero(system.state_size());
    for (std::size_t i = plan.count(); i-- > 0;) {
      const double factor = plan.measurement(i).factor;
      const int sensor = plan.measurement(i).sensor, mode = table.mode(h, sensor);
      values_[i] = {none, none};
      if (!system.modes(sensor)[mode].removes_rows()) {
        const double variance = factor * factor * system.variance(sensor, mode);
        const desync::Whitened w =
            system.with_row(sensor, records_[i].at, [&](const auto& row) SUREFIX_LAMBDA {
              return desync::sweep_back(adjoint, row, records_[i].innovation);
            });
        values_[i] = {variance * w.value, variance * variance * w.precision};
      }
      if (plan.leg(i).elapsed == 0) continue;
      plan.leg(i).transition.apply_transposed(adjoint.lambda);
      propagate_transposed(adjoint.Lambda, plan.leg(i).transition);
    }
  }

  Pack pack_;
  std::vector<Record> records_;
  std::vector<Value> values_;
};

}  // namespace surefix::robust
