#include <cmath>

#include "bank_filter.hpp"

namespace surefix::switching {

ConfigStatus AnyLinearFilter::make(const LinearSystem& system, const ModeChain& chain,
                                   const std::vector<Eigen::MatrixXd>& p,
                                   const Eigen::MatrixXd& nominal, AnyLinearFilter& out) {
  PreparedSystem<AnySizes> checked;
  const ConfigStatus status = checked.make(system);
  if (status != ConfigStatus::ok) return status;
  const bool path = nominal.size() == 0 || nominal.cols() == system.size();
  if (!fits(chain, p) || !path) return ConfigStatus::wrong_size;
  out.system_ = system;
  out.chain_ = chain;
  out.p_ = p;
  out.nominal_ = nominal;
  return ConfigStatus::ok;
}

bool AnyLinearFilter::compute(const double* z, int T, Gains& out, int& failed) const {
  const int m = system_.measured();
  LinearRecursion recursion(chain_, system_.x0, system_.P0, nominal_.size() > 0);
  LinearStep step;
  for (int k = 0; k < T; ++k) {
    if (k > 0) {
      step.A = of_step(system_.A, k - 1);
      step.Q = of_step(system_.Q, k - 1);
    }
    step.H = of_step(system_.H, k);
    step.R = of_step(system_.R, k);
    if (nominal_.size() > 0) step.nominal = nominal_.row(k);
    std::array<bool, AnySizes::max_m> exists{};
    for (int i = 0; i < m; ++i) exists[at(i)] = z == nullptr || !std::isnan(z[k * m + i]);
    out.gain.emplace_back();
    if (!recursion.advance(step, k > 0 ? &of_step(p_, k - 1) : nullptr, exists.data(),
                           out.gain.back())) {
      failed = k;
      return false;
    }
    out.error.push_back(recursion.error());
    out.mean_gamma.push_back(recursion.mean_gamma());
  }
  return true;
}

BatchStatus AnyLinearFilter::filter(const Gains& gains, const BatchRequest& in, std::int64_t run,
                                    const BatchOutput& out) const {
  const int n = system_.size(), m = system_.measured();
  std::array<double, AnySizes::max_n> now{}, next{};  // x̂, or x̂ − x̄
  for (int k = 0; k < in.T; ++k) {
    const LinearGain& gain = gains.gain[at(k)];
    const double* z = in.z + (run * in.T + k) * m;
    for (int a = 0; a < n; ++a) {
      double sum = 0.0;
      for (int b = 0; b < n; ++b) sum += gain.F1(a, b) * now[at(b)];
      for (int i = 0; i < m; ++i) {
        double value = z[i];
        if (std::isnan(value)) continue;
        if (nominal_.size() > 0)
          value -= gains.mean_gamma[at(k)] * of_step(system_.H, k).row(i).dot(nominal_.row(k));
        sum += gain.F2(a, i) * value;
      }
      if (!finite(sum)) return {Status::numerical, run, k};
      next[at(a)] = sum;
    }
    now = next;
    const std::int64_t row = run * in.T + k;
    for (int a = 0; a < n; ++a) {
      if (out.x != nullptr)
        out.x[row * n + a] = now[at(a)] + (nominal_.size() > 0 ? nominal_(k, a) : 0.0);
      if (out.P == nullptr) continue;
      for (int b = 0; b < n; ++b) out.P[(row * n + a) * n + b] = gains.error[at(k)](a, b);
    }
  }
  return {};
}

BatchStatus AnyLinearFilter::run(const BatchRequest& in, const BatchOutput& out) const {
  const int m = system_.measured();
  Gains common;
  int failed = 0;
  if (!compute(nullptr, in.T, common, failed)) return {Status::numerical, in.first, failed};
  for (std::int64_t run = in.first; run < in.last; ++run) {
    const double* z = in.z + run * in.T * m;
    bool missing = false;
    for (int k = 0; k < in.T; ++k)
      for (int i = 0; i < m; ++i) {
        if (std::isinf(z[k * m + i])) return {Status::not_finite, run, k};
        missing |= std::isnan(z[k * m + i]);
      }
    Gains own;
    if (missing && !compute(z, in.T, own, failed)) return {Status::numerical, run, failed};
    const BatchStatus status = filter(missing ? own : common, in, run, out);
    if (status.status != Status::ok) return status;
  }
  return {};
}

}  // namespace surefix::switching
