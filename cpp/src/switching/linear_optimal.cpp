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

/// X_j ← Σ_i p_ij X_i.
template <class T>
void move_modes(const Matrix& p, std::vector<T>& X) {
  std::vector<T> moved;
  for (Eigen::Index j = 0; j < p.cols(); ++j) {
    T sum = p(0, j) * X[0];
    for (Eigen::Index i = 1; i < p.rows(); ++i) sum += p(i, j) * X[static_cast<std::size_t>(i)];
    moved.push_back(std::move(sum));
  }
  X = std::move(moved);
}

}  // namespace

LinearRecursion::LinearRecursion(const ModeChain& chain, const Vector& x0, const Matrix& P0,
                                 bool nominal)
    : chain_(chain), law_(chain.initial), nominal_(nominal) {
  const Eigen::Index n = x0.size();
  C_ = nominal ? P0 : Matrix(P0 + x0 * x0.transpose());
  V_ = Matrix::Zero(n, n);
  for (int j = 0; j < chain.size(); ++j) {
    xx_.emplace_back(law_(j) * C_);
    ex_.emplace_back(Matrix::Zero(n, n));
    ee_.emplace_back(Matrix::Zero(n, n));
    e_.emplace_back(Vector::Zero(n));
  }
}

bool LinearRecursion::advance(const LinearStep& step, const Matrix* p, const bool* present,
                              LinearGain& gain) {
  const Eigen::Index n = C_.rows(), m = step.H.rows();
  std::vector<int> rows;
  for (int i = 0; i < m; ++i)
    if (present == nullptr || present[i]) rows.push_back(i);
  const Matrix H = step.H(rows, Eigen::all), R = step.R(rows, rows);
  const Vector gamma = gammas(chain_);

  const bool moves = p != nullptr;
  Matrix A = Matrix::Identity(n, n);
  Matrix Q = Matrix::Zero(n, n);
  p11_ = 0.0;
  if (moves) {
    A = step.A;
    Q = step.Q;
    if (seen_.size() > 0) seen_ = Vector(p->transpose() * seen_);
    p11_ = seen_.size() > 0 ? seen_.dot(gamma) : 0.0;
    law_ = Vector(p->transpose() * law_);
    for (auto* X : {&xx_, &ex_, &ee_}) move_modes(*p, *X);
    move_modes(*p, e_);
  }
  const double e1 = law_.dot(gamma), e2 = law_.dot(gamma.cwiseAbs2());
  double delta = 0.0;
  for (int j = 0; j < chain_.size(); ++j) delta += law_(j) * mean_delta(chain_, j);
  mean_gamma_ = e1;
  if (e1 != 0.0) seen_ = law_.cwiseProduct(gamma) / e1;

  // (23b-e)
  C_ = symmetric(A * C_ * A.transpose() + Q);
  const Matrix AVA = symmetric(A * V_ * A.transpose());
  Matrix noise = R * delta;
  Vector Hx = Vector::Zero(H.rows());
  if (nominal_) {
    Hx = H * step.nominal;
    noise += (e2 - e1 * e1) * Hx * Hx.transpose();
  }
  const Matrix read = e2 * H * C_ * H.transpose() + noise;
  const Matrix S = symmetric(read - p11_ * p11_ * H * AVA * H.transpose());
  Matrix F2(n, H.rows());
  if (H.rows() > 0) {
    const Eigen::LDLT<Matrix> factors(S);
    if (!(factors.vectorD().array() > 0.0).all()) return false;
    F2 = factors.solve(H * (e1 * C_ - p11_ * AVA)).transpose();
  }
  const Matrix F1 = A - p11_ * F2 * H * A;
  const Matrix cross = p11_ * F2 * H * A * V_ * F1.transpose();
  V_ = symmetric(F1 * V_ * F1.transpose() + F2 * read * F2.transpose() + cross + cross.transpose());

  for (int j = 0; j < chain_.size(); ++j) {
    Matrix &xx = xx_[static_cast<std::size_t>(j)], &ex = ex_[static_cast<std::size_t>(j)],
           &ee = ee_[static_cast<std::size_t>(j)];
    Vector& e = e_[static_cast<std::size_t>(j)];
    if (moves) {
      xx = symmetric(A * xx * A.transpose() + law_(j) * Q);
      ex = ex * A.transpose();
    }
    const double g = gamma(j);
    const Matrix half = g * F1 * ex * H.transpose() * F2.transpose();
    ee = F1 * ee * F1.transpose() + half + half.transpose() +
         F2 * (g * g * H * xx * H.transpose() + law_(j) * mean_delta(chain_, j) * R) *
             F2.transpose();
    if (nominal_) {  // what the nominal trajectory is missed by, (γ − E γ) H x̄
      const Vector missed = (g - e1) * (F2 * Hx);
      const Matrix mixed = F1 * e * missed.transpose();
      ee += mixed + mixed.transpose() + law_(j) * missed * missed.transpose();
      e = F1 * e + law_(j) * missed;
    }
    ee = symmetric(ee);
    ex = F1 * ex + g * F2 * H * xx;
  }
  gain.F1 = F1;
  gain.F2 = Matrix::Zero(n, m);
  gain.F2(Eigen::all, rows) = F2;
  return gain.F1.allFinite() && gain.F2.allFinite();
}

Matrix LinearRecursion::error() const {
  Matrix error = Matrix::Zero(C_.rows(), C_.cols());
  for (std::size_t j = 0; j < xx_.size(); ++j)
    error += xx_[j] - ex_[j] - ex_[j].transpose() + ee_[j];
  return symmetric(error);
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
