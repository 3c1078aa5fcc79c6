// What a step of the robust filter says: the mixture in numbers, and limits that hold.
#pragma once

#include <vector>

#include "surefix/robust/alert_limits.hpp"
#include "surefix/robust/recursion.hpp"

namespace surefix::robust {

/// Limits on aᵀx that the truth is outside of with probability `risk`.
struct LimitRequest {
  std::vector<double> a;  ///< (n) of the base system's states
  double risk = 1e-11;    ///< of one estimate, in (0, 1)
  Sides sides = Sides::both;

  [[nodiscard]] ConfigStatus check(int n) const noexcept {
    if (static_cast<int>(a.size()) != n) return ConfigStatus::wrong_size;
    for (const double value : a)
      if (!std::isfinite(value)) return ConfigStatus::not_finite;
    return risk > 0.0 && risk < 1.0 ? ConfigStatus::ok : ConfigStatus::risk;
  }
};

/// One estimate. Pointers are into the filter and hold until its next estimate.
struct RobustEstimate {
  const double* x = nullptr;                 ///< (n) mean of the mixture, base states
  const double* P = nullptr;                 ///< (n, n) its covariance
  const double* mode_probability = nullptr;  ///< (sensors, SensorModes::max_modes)
  double lower = 0.0;      ///< −∞: no limit can be claimed at this risk, or none was asked for
  double upper = 0.0;      ///< +∞: as above
  double discarded = 0.0;  ///< probability that the truth was cut off; taken from the risk
  double sse = 0.0;        ///< Σ ν²/S under the most probable hypothesis
  std::int32_t degrees = 0;  ///< measurements that it did not remove
  int hypothesis = 0;        ///< the most probable one, index in the mode table
};

/// Puts the last step of a recursion into numbers; no heap after construction.
class Evaluation {
 public:
  Evaluation() = default;
  template <class FaultSystem>
  Evaluation(const Recursion<FaultSystem>& recursion, const LimitRequest& request)
      : request_(request),
        x_(request.a.size()),
        P_(request.a.size() * request.a.size()),
        modes_(static_cast<std::size_t>(recursion.table().sensors() * SensorModes::max_modes)),
        mass_(static_cast<std::size_t>(recursion.table().count())),
        weight_(recursion.hypotheses().capacity()),
        mean_(weight_.size()),
        sigma_(weight_.size()) {}

  template <class FaultSystem>
  [[nodiscard]] RobustEstimate operator()(const Recursion<FaultSystem>& recursion) noexcept {
    const Components& mixture = recursion.hypotheses();
    const int n = static_cast<int>(x_.size());
    moments(mixture, n, x_.data(), P_.data());
    mode_probabilities(mixture, recursion.table(), modes_.data());
    const std::size_t best = most_probable(mixture, mass_);
    RobustEstimate out;
    out.x = x_.data();
    out.P = P_.data();
    out.mode_probability = modes_.data();
    out.discarded = recursion.discarded();
    out.hypothesis = mixture.hypothesis(best);
    out.sse = mixture.squares(best);
    out.degrees = recursion.degrees(best);
    find_limits(mixture, out);
    return out;
  }

 private:
  void find_limits(const Components& mixture, RobustEstimate& out) noexcept {
    const int n = static_cast<int>(x_.size()), m = mixture.state_size();
    for (std::size_t c = 0; c < mixture.count(); ++c) {
      weight_[c] = std::exp(mixture.log_weight(c));
      mean_[c] = sigma_[c] = 0.0;
      if (weight_[c] == 0.0) continue;  // it may have overflowed
      double mean = 0.0, variance = 0.0;
      for (int j = 0; j < n; ++j) {
        mean += a(j) * mixture.x(c)[j];
        for (int i = 0; i < n; ++i) variance += a(i) * a(j) * mixture.P(c)[j * m + i];
      }
      mean_[c] = mean;
      sigma_[c] = std::sqrt(std::max(variance, 0.0));
    }
    const TailMixture tails{weight_.data(), mean_.data(), sigma_.data(), mixture.count()};
    // What was cut off may lie anywhere: its probability comes off the risk. Where nothing is left
    // the limits are infinite.
    const AlertLimits limits =
        robust::find_limits(tails, request_.risk - out.discarded, request_.sides);
    out.lower = limits.lower;
    out.upper = limits.upper;
  }
  [[nodiscard]] double a(int i) const noexcept { return request_.a[static_cast<std::size_t>(i)]; }

  LimitRequest request_;
  std::vector<double> x_, P_, modes_, mass_, weight_, mean_, sigma_;
};

}  // namespace surefix::robust
