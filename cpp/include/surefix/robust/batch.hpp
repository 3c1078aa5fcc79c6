// A whole log at once: the same recursion, so the same bits as measurement by measurement.
#pragma once

#include "surefix/desync/batch_request.hpp"
#include "surefix/desync/sorted_log.hpp"
#include "surefix/robust/estimate.hpp"

namespace surefix::robust {

/// Where a batch writes: arrays of T estimates of n base states and S sensors, and of N rows.
struct BatchOutput {
  double* time;              ///< (T) [s]
  double* x;                 ///< (T, n)
  double* P;                 ///< (T, n, n)
  double* lower;             ///< (T)
  double* upper;             ///< (T)
  double* mode_probability;  ///< (T, S, SensorModes::max_modes)
  std::int32_t* hypothesis;  ///< (T) the most probable one, index in the mode table
  double* discarded;         ///< (T)
  double* sse;               ///< (T) under the most probable hypothesis
  std::int32_t* degrees;     ///< (T)
  Status* status;            ///< (N) what became of every row
  std::int64_t* estimate;    ///< (N) the estimate whose step used the row; −1: none
  double* outlier;           ///< (N) probability that it is an outlier, for used rows and
                             ///< hypotheses per measurement; null: not wanted
  double* noise;             ///< (N) v̂ of used rows under the most probable hypothesis; null: not
                             ///< wanted, nor available for hypotheses per measurement
  double* noise_variance;    ///< (N) its variance
};

/// One batch under way.
template <class FaultSystem>
class BatchRun {
 public:
  BatchRun(Recursion<FaultSystem>& recursion, Evaluation& evaluation,
           const desync::SortedLog& sorted, const BatchOutput& out)
      : recursion_(recursion), evaluation_(evaluation), sorted_(sorted), out_(out) {}

  /// Estimates at the times of the request, or at every distinct validity time. Stops at the first
  /// that cannot be made and returns its status; `made` counts those before it.
  [[nodiscard]] Status run(const desync::BatchRequest& request, std::size_t& made) {
    std::size_t next = 0;
    for (; next < sorted_.size() && sorted_[next].valid < recursion_.time(); ++next)
      out_.status[sorted_[next].id] = Status::too_late;
    const bool given = request.times != nullptr;
    for (made = 0; given ? made < request.T : next < sorted_.size();) {
      const Time time = given ? request.times[made] : sorted_[next].valid;
      if (!in_range(time)) return Status::not_finite;
      gather(request, time, next);
      if (time < recursion_.time()) return Status::time_backwards;
      const Status status = step(time, made);
      const bool between = !given && status == Status::off_grid;  // a row that no period leads to
      if (status != Status::ok && !between) return status;
      if (status == Status::ok) ++made;
    }
    for (; next < sorted_.size(); ++next) out_.status[sorted_[next].id] = Status::waiting;
    return Status::ok;
  }

 private:
  /// The measurements of the step that ends at `time`.
  void gather(const desync::BatchRequest& request, Time time, std::size_t& next) {
    step_.clear();
    for (; next < sorted_.size() && sorted_[next].valid <= time; ++next) {
      const Measurement m = sorted_[next];
      const bool late =
          request.delay != desync::any_delay && sorted_.stamp(next) > time + request.delay;
      if (late) out_.status[m.id] = Status::too_late;
      if (out_.status[m.id] == Status::ok) step_.push_back(m);
    }
  }

  [[nodiscard]] Status step(Time time, std::size_t made) {
    recursion_.reserve(step_.size());
    const Status status = recursion_.advance(step_.data(), step_.size(), time);
    if (status == Status::off_grid)
      for (const Measurement& m : step_) out_.status[m.id] = status;
    if (status != Status::ok) return status;
    std::size_t used = 0;
    for (std::size_t i = 0; i < step_.size(); ++i) {
      const std::int64_t row = step_[i].id;
      out_.status[row] = recursion_.status(i);
      if (recursion_.status(i) != Status::ok) continue;
      out_.estimate[row] = static_cast<std::int64_t>(made);
      if (out_.outlier != nullptr) out_.outlier[row] = recursion_.outlier(used);
      if (out_.noise != nullptr) {
        out_.noise[row] = recursion_.noise(used).noise;
        out_.noise_variance[row] = recursion_.noise(used).variance;
      }
      ++used;
    }
    write(evaluation_(recursion_), time, made);
    return status;
  }

  void write(const RobustEstimate& e, Time time, std::size_t t) const noexcept {
    const auto n = static_cast<std::size_t>(recursion_.system().base_size());
    const auto modes =
        static_cast<std::size_t>(recursion_.table().sensors() * SensorModes::max_modes);
    out_.time[t] = seconds(time);
    std::copy(e.x, e.x + n, out_.x + t * n);
    std::copy(e.P, e.P + n * n, out_.P + t * n * n);
    out_.lower[t] = e.lower;
    out_.upper[t] = e.upper;
    std::copy(e.mode_probability, e.mode_probability + modes, out_.mode_probability + t * modes);
    out_.hypothesis[t] = e.hypothesis;
    out_.discarded[t] = e.discarded;
    out_.sse[t] = e.sse;
    out_.degrees[t] = e.degrees;
  }

  Recursion<FaultSystem>& recursion_;
  Evaluation& evaluation_;
  const desync::SortedLog& sorted_;
  const BatchOutput out_;
  std::vector<Measurement> step_;
};

}  // namespace surefix::robust
