// The forward pass of a linear system with known inputs: x_k = A x_{k−1} + u_k + w, z_k = H x_k + v
// (Parellier, Barrau & Bonnabel 2023, (1)-(6)). Gains do not depend on the measurements, so they
// are made once for all runs in which the same components are missing.
#pragma once

#include <cmath>
#include <limits>

#include "surefix/core/lane.hpp"
#include "surefix/core/linear_system.hpp"
#include "surefix/core/predict.hpp"
#include "surefix/core/update.hpp"
#include "surefix/drift/forward_record.hpp"

namespace surefix::drift {

/// z (runs, T, m), NaN where a component is missing; inputs (T − 1, n), entry k leads from
/// measurement k to k + 1, or null; times (T), ascending.
struct SystemData {
  const double* z;
  const double* inputs;
  const double* times;
  std::int64_t runs;
  int T;
  double* x = nullptr;  ///< (runs, T, n) estimates; null: not wanted
  double* P = nullptr;  ///< (T, n, n)
};

/// Gains, rows and transitions of one run. `numerical` if an innovation's variance is not positive
/// and finite.
template <class S, class Record>
class GainPass {
 public:
  GainPass(const PreparedSystem<S>& system, const SystemData& data, Record& record)
      : system_(system), data_(data), record_(record), belief_(system.initial()) {
    F_ = system.initial().P;  // the size
    for (int k = 0; k < data.T && !mixed_; ++k) mixed_ = system.observation(k).correlated();
  }

  [[nodiscard]] Status run() {
    const int m = system_.measured();
    for (int k = 0; k < data_.T; ++k) {
      if (k > 0) move(k);
      const double* z = data_.z + static_cast<std::ptrdiff_t>(k) * m;
      present_.clear();
      for (int c = 0; c < m; ++c)
        if (!std::isnan(z[c])) present_.push_back(c);
      if (!read(k, z)) return Status::numerical;
      if (data_.P == nullptr) continue;
      const int n = belief_.size();
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) data_.P[(k * n + j) * n + i] = belief_.P(i, j);
    }
    return Status::ok;
  }

 private:
  void move(int k) {
    const auto& transition = system_.transition(k);
    predict(belief_, transition);
    if (waiting_) {
      F_ = typename BeliefOf<S>::Matrix(transition.F * F_);
    } else {
      F_ = transition.F;
    }
    waiting_ = true;
    elapsed_ += data_.times[k] - data_.times[k - 1];
  }

  /// Those components of z that are present.
  [[nodiscard]] bool read(int k, const double* z) {
    const int m = system_.measured();
    if (present_.empty()) return true;
    if (static_cast<int>(present_.size()) == m) return take(k, system_.observation(k));
    MeasuredOf<S> all(m);
    for (int c = 0; c < m; ++c) all(c) = z[c];
    MeasuredOf<Reduced<S>> values;
    Observation<Reduced<S>> part;
    return part.reduce(system_.observation(k), all, values) && take(k, part);
  }

  template <class O>
  [[nodiscard]] bool take(int k, const Observation<O>& observation) {
    const int m = system_.measured(), count = observation.size();
    Eigen::MatrixXd mixing = Eigen::MatrixXd::Zero(mixed_ ? count : 0, m);  // L⁻¹
    for (int c = 0; mixed_ && c < count; ++c) {
      MeasuredOf<O> unit = MeasuredOf<O>::Zero(count);
      unit(c) = 1.0;
      observation.whiten(unit);
      for (int i = 0; i < count; ++i) mixing(i, present_[static_cast<std::size_t>(c)]) = unit(i);
    }
    for (int i = 0; i < count; ++i) {
      const auto h = observation.row(i, 1.0);
      const DenseRow<std::decay_t<decltype(h)>> row{h};
      Innovation<BeliefOf<S>> innovation;
      if (!update(belief_, row, observation.variance(i), 0.0, innovation)) return false;
      const std::int32_t channel = present_[static_cast<std::size_t>(i)];
      const auto id = static_cast<std::int64_t>(k) * m + channel;
      record_.add(converted(innovation), row, observation.variance(i), F_, elapsed_, channel, id);
      if (mixed_) {
        const Eigen::VectorXd own = mixing.row(i);
        record_.mix(own.data());
      }
      elapsed_ = 0.0;
    }
    waiting_ = false;
    return true;
  }

  /// Between beliefs that differ in storage only.
  static Innovation<typename Record::Belief> converted(
      const Innovation<BeliefOf<S>>& from) noexcept {
    return {from.value, from.variance, from.inverse, typename Record::Belief::Vector(from.gain)};
  }

  const PreparedSystem<S>& system_;
  const SystemData& data_;
  Record& record_;
  BeliefOf<S> belief_;
  typename BeliefOf<S>::Matrix F_;  // since the last measurement
  bool waiting_ = false;            // there was a step without one
  double elapsed_ = 0.0;
  bool mixed_ = false;
  std::vector<std::int32_t> present_;
};

/// Innovations of runs `first` to first + lanes − 1 into `out` (runs, size of the record).
template <class Lane, class S, class Record>
void pass_means(const PreparedSystem<S>& system, const SystemData& data, const Record& record,
                std::int64_t first, int lanes, double* out) noexcept {
  using L = Lanes<Lane>;
  const int n = system.size(), m = system.measured();
  const auto runs_of = [&](int l) { return first + std::min(l, lanes - 1); };
  typename Gaussian<S::n, Lane, S::max_n>::Vector x(n);
  for (int i = 0; i < n; ++i) x(i) = L::all(system.initial().x(i));
  std::size_t at = 0;
  for (int k = 0; k < data.T; ++k) {
    if (k > 0) {
      system.transition(k).apply(x);
      if (data.inputs != nullptr)
        for (int i = 0; i < n; ++i) x(i) += data.inputs[static_cast<std::ptrdiff_t>(k - 1) * n + i];
    }
    for (; at < record.size() && record.id(at) < static_cast<std::int64_t>(k + 1) * m; ++at) {
      const auto measurement = record[at];
      Lane innovation;
      for (int l = 0; l < L::count; ++l) {
        const double* z = data.z + (runs_of(l) * data.T + k) * m;
        L::set(innovation, l, record.whitened(at, z));
      }
      loop<S::n>(n, [&](int i) SUREFIX_LAMBDA { innovation -= measurement.row(i) * x(i); });
      loop<S::n>(n, [&](int i) SUREFIX_LAMBDA { x(i) += measurement.gain(i) * innovation; });
      for (int l = 0; l < lanes; ++l)
        out[static_cast<std::size_t>(first + l) * record.size() + at] = L::get(innovation, l);
    }
    if (data.x == nullptr) continue;
    for (int l = 0; l < lanes; ++l)
      for (int i = 0; i < n; ++i) data.x[((first + l) * data.T + k) * n + i] = L::get(x(i), l);
  }
}

}  // namespace surefix::drift
