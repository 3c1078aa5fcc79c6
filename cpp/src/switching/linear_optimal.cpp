#include "surefix/switching/linear_optimal.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace surefix::switching {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

Matrix symmetric(const Matrix& M) { return 0.5 * (M + M.transpose()); }

/// γ of every mode.
Vector gammas(const ModeChain& chain) {
  return Eigen::Map<const Vector>(chain.gamma.data(), chain.size());
}

/// The mean δ of a mode's branches.
double mean_delta(const ModeChain& chain, int mode) {
  double mean = 0.0;
  for (const Branch& branch : chain.branches[static_cast<std::size_t>(mode)])
    mean += branch.share * branch.delta;
  return mean;
}

}  // namespace

LinearRecursion::LinearRecursion(const ModeChain& chain, const Vector& x0, const Matrix& P0,
                                 bool nominal)
    : chain_(chain), law_(chain.initial), nominal_(nominal) {
  const Eigen::Index n = x0.size();
  C_ = nominal ? P0 : Matrix(P0 + x0 * x0.transpose());
  Sigma_ = C_;
  for (int j = 0; j < chain.size(); ++j)
    modes_.push_back({law_(j) * C_, law_(j) * C_, law_(j) * C_, Vector::Zero(n)});
}

void LinearRecursion::move(const LinearStep& step, const Matrix& p) {
  const Matrix &A = step.A, &Q = step.Q;
  law_ = Vector(p.transpose() * law_);
  if (seen_.size() > 0) seen_ = Vector(p.transpose() * seen_);
  C_ = symmetric(A * C_ * A.transpose() + Q);  // (23d)
  Sigma_ = symmetric(A * Sigma_ * A.transpose() + Q);
  std::vector<Moments> moved;
  for (Eigen::Index j = 0; j < p.cols(); ++j) {
    Moments sum = modes_.front();
    sum.scale(p(0, j));
    for (Eigen::Index i = 1; i < p.rows(); ++i)
      sum.add(p(i, j), modes_[static_cast<std::size_t>(i)]);
    const Matrix noise = law_(j) * Q;
    sum.xx = symmetric(A * sum.xx * A.transpose() + noise);
    sum.ex = A * sum.ex * A.transpose() + noise;
    sum.ee = symmetric(A * sum.ee * A.transpose() + noise);
    sum.e = Vector(A * sum.e);
    moved.push_back(std::move(sum));
  }
  modes_ = std::move(moved);
}

bool LinearRecursion::advance(const LinearStep& step, const Matrix* p, const bool* present,
                              LinearGain& gain) {
  const Eigen::Index n = C_.rows(), m = step.H.rows();
  std::vector<int> rows;
  for (int i = 0; i < m; ++i)
    if (present == nullptr || present[i]) rows.push_back(i);
  const Matrix H = step.H(rows, Eigen::all), R = step.R(rows, rows);
  const Vector gamma = gammas(chain_);
  if (p != nullptr) move(step, *p);

  const double e1 = law_.dot(gamma), e2 = law_.dot(gamma.cwiseAbs2());
  double delta = 0.0;
  for (int j = 0; j < chain_.size(); ++j) delta += law_(j) * mean_delta(chain_, j);
  // Before anything was measured x̂ = 0, and any p11 gives the same: this one subtracts nothing.
  const double p11 = seen_.size() > 0 ? seen_.dot(gamma) : e1;
  if (e1 != 0.0) seen_ = law_.cwiseProduct(gamma) / e1;
  mean_gamma_ = e1;

  // (23c) with V = C − Σ: e₁ C − p11 A V Aᵀ = p11 Σ⁻ + (e₁ − p11) C, and so on.
  Vector Hx = Vector::Zero(H.rows());
  Matrix noise = R * delta;
  if (nominal_) {
    Hx = H * step.nominal;
    noise += (e2 - e1 * e1) * Hx * Hx.transpose();
  }
  const Matrix HCH = H * C_ * H.transpose(), crossed = (e1 - p11) * H * C_;
  const Matrix S =
      symmetric(p11 * p11 * H * Sigma_ * H.transpose() + (e2 - p11 * p11) * HCH + noise);
  Matrix F2(n, H.rows());
  if (H.rows() > 0) {
    const Eigen::LDLT<Matrix> factors(S);
    if (!(factors.vectorD().array() > 0.0).all()) return false;
    F2 = factors.solve(p11 * H * Sigma_ + crossed).transpose();
  }

  // (23e) for Σ in Joseph's form: e ← J e − F2 ((γ − p11) H x + v).
  const Matrix J = Matrix::Identity(n, n) - p11 * F2 * H;
  const Matrix missed = J * crossed.transpose() * F2.transpose();
  Sigma_ = symmetric(J * Sigma_ * J.transpose() - missed - missed.transpose() +
                     F2 * ((e2 - 2.0 * p11 * e1 + p11 * p11) * HCH + noise) * F2.transpose());
  for (int j = 0; j < chain_.size(); ++j) {
    Moments& now = modes_[static_cast<std::size_t>(j)];
    const double g = gamma(j) - p11;
    const Matrix half = g * J * now.ex * H.transpose() * F2.transpose();
    const Matrix read = g * g * H * now.xx * H.transpose() + law_(j) * mean_delta(chain_, j) * R;
    now.ee = J * now.ee * J.transpose() - half - half.transpose() + F2 * read * F2.transpose();
    if (nominal_) {  // what the nominal trajectory is missed by, (γ − E γ) H x̄
      const Vector u = (gamma(j) - e1) * (F2 * Hx);
      const Matrix mixed = J * now.e * u.transpose();
      now.ee += law_(j) * u * u.transpose() - mixed - mixed.transpose();
      now.e = Vector(J * now.e - law_(j) * u);
    }
    now.ee = symmetric(now.ee);
    now.ex = Matrix(J * now.ex - g * F2 * H * now.xx);
  }
  gain.F1 = p != nullptr ? Matrix(J * step.A) : J;
  gain.F2 = Matrix::Zero(n, m);
  gain.F2(Eigen::all, rows) = F2;
  return gain.F1.allFinite() && gain.F2.allFinite();
}

Matrix LinearRecursion::error() const {
  Matrix error = modes_.front().ee;
  for (std::size_t j = 1; j < modes_.size(); ++j) error += modes_[j].ee;
  return error;
}

LinearCondition check_linear(const ModeChain& chain, const std::vector<Matrix>& p, int steps) {
  constexpr int most_lags = 256;
  const Vector gamma = gammas(chain);
  LinearCondition out{true, 0.0, 0.0, 0.0, 0.0, 0};
  Vector law = chain.initial;
  // Column c: the law of the mode now, weighed by γ_i of the step i that it belongs to.
  std::vector<Vector> seen;
  bool any = false;
  for (int k = 0; k < steps; ++k) {
    if (k > 0) {
      const Matrix& now = p.size() == 1 ? p[0] : p[static_cast<std::size_t>(k - 1)];
      law = now.transpose() * law;
      double low = 0.0, high = 0.0;
      for (std::size_t c = 0; c < seen.size(); ++c) {
        seen[c] = now.transpose() * seen[c];
        const double value = seen[c].dot(gamma);
        low = c == 0 || value < low ? value : low;
        high = c == 0 || value > high ? value : high;
        if (c + 1 == seen.size()) out.p11 = value;
      }
      if (!seen.empty()) {
        out.lags = std::max(out.lags, static_cast<int>(seen.size()));
        out.lowest = any ? std::min(out.lowest, low) : low;
        out.highest = any ? std::max(out.highest, high) : high;
        out.spread = std::max(out.spread, high - low);
        any = true;
      }
    }
    const double mean = law.dot(gamma);
    if (mean != 0.0) seen.push_back(law.cwiseProduct(gamma) / mean);
    if (seen.size() > most_lags) seen.erase(seen.begin());
  }
  out.holds = out.spread <= 1e-9;
  return out;
}

}  // namespace surefix::switching
