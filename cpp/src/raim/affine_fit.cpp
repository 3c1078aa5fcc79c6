#include "surefix/raim/affine_fit.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <vector>

namespace surefix::raim {
namespace {

/// Samples moved and scaled into [−1, 1]: Φ has rows φ = (1, ξ), ξ_j = (X_j − middle_j)/half_j.
struct Samples {
  Eigen::MatrixXd phi;
  Eigen::VectorXd middle, half;

  explicit Samples(const Eigen::MatrixXd& X) : phi(X.rows(), X.cols() + 1) {
    const Eigen::VectorXd low = X.colwise().minCoeff(), high = X.colwise().maxCoeff();
    middle = 0.5 * (low + high);
    half = (0.5 * (high - low)).cwiseMax(1e-300);
    phi.col(0).setOnes();
    for (Eigen::Index j = 0; j < X.cols(); ++j)
      phi.col(j + 1) = (X.col(j).array() - middle(j)) / half(j);
  }

  /// In X what `coefficients` (1 + m × n) are in ξ.
  [[nodiscard]] AffineFit in_units(const Eigen::MatrixXd& coefficients,
                                   const Eigen::VectorXd& rho) const {
    AffineFit fit;
    fit.A = coefficients.bottomRows(half.size()).transpose();
    for (Eigen::Index j = 0; j < half.size(); ++j) fit.A.col(j) /= half(j);
    fit.B = coefficients.row(0).transpose() - fit.A * middle;
    fit.rho = rho;
    return fit;
  }
};

/// The linear program in its dual form: among the weights y_j of samples with Σ y_j φ_j = 0 and
/// Σ |y_j| = 1 those with the largest Σ y_j e_j. m + 2 samples are a basis; where the error of the
/// affine function that equalises them is largest, a sample enters.
class Exchange {
 public:
  Exchange(const Eigen::MatrixXd& phi, const std::vector<Eigen::Index>& start)
      : phi_(phi), basis_(start), columns_(phi.cols() + 1, phi.cols() + 1) {
    const Eigen::Index p = phi.cols();
    sign_.assign(basis_.size(), 1.0);
    // Of the samples' one linear dependency, the signs; it is feasible.
    Eigen::MatrixXd first(p, p);
    for (Eigen::Index i = 0; i < p; ++i) first.col(i) = row(basis_[static_cast<std::size_t>(i)]);
    const Eigen::VectorXd y = first.colPivHouseholderQr().solve(row(basis_.back()));
    for (Eigen::Index i = 0; i < p; ++i)
      if (y(i) > 0.0) sign_[static_cast<std::size_t>(i)] = -1.0;
    for (Eigen::Index i = 0; i <= p; ++i) place(i);
  }

  /// Coefficients (1 + m) of the best fit to `error` (k), and the largest error left.
  double solve(const Eigen::VectorXd& error, Eigen::VectorXd& best) {
    double left = error.cwiseAbs().maxCoeff();
    best = Eigen::VectorXd::Zero(phi_.cols());
    const int patience = 64 + 8 * static_cast<int>(phi_.cols());
    for (int round = 0; round < 4 * patience; ++round) {
      const Eigen::PartialPivLU<Eigen::MatrixXd> lu(columns_);
      const Eigen::VectorXd prices = lu.transpose().solve(costs(error));
      if (!prices.allFinite()) break;
      const Eigen::VectorXd c = prices.head(phi_.cols());
      const Eigen::VectorXd rest = error - phi_ * c;
      Eigen::Index enters = 0;
      const double largest = rest.cwiseAbs().maxCoeff(&enters);
      if (largest < left) left = largest, best = c;
      const double level = prices(phi_.cols());
      if (largest <= level * (1.0 + 1e-12) + 1e-300) break;
      if (round > patience)  // Bland's rule: a tie cannot go round for ever
        for (enters = 0; std::abs(rest(enters)) <= level * (1.0 + 1e-12); ++enters) {
        }
      if (!exchange(lu, enters, rest(enters) < 0.0 ? -1.0 : 1.0)) break;
    }
    return left;
  }

 private:
  [[nodiscard]] Eigen::VectorXd row(Eigen::Index sample) const {
    return phi_.row(sample).transpose();
  }
  void place(Eigen::Index i) {
    const auto k = static_cast<std::size_t>(i);
    columns_.col(i).head(phi_.cols()) = sign_[k] * row(basis_[k]);
    columns_(phi_.cols(), i) = 1.0;
  }
  [[nodiscard]] Eigen::VectorXd costs(const Eigen::VectorXd& error) const {
    Eigen::VectorXd out(columns_.cols());
    for (Eigen::Index i = 0; i < out.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      out(i) = sign_[k] * error(basis_[k]);
    }
    return out;
  }
  bool exchange(const Eigen::PartialPivLU<Eigen::MatrixXd>& lu, Eigen::Index enters, double sign) {
    const Eigen::Index p = phi_.cols();
    Eigen::VectorXd column(p + 1), one = Eigen::VectorXd::Zero(p + 1);
    column << sign * row(enters), 1.0;
    one(p) = 1.0;
    const Eigen::VectorXd direction = lu.solve(column), weights = lu.solve(one);
    Eigen::Index leaves = -1;
    double ratio = 0.0;
    for (Eigen::Index i = 0; i <= p; ++i) {
      if (direction(i) <= 1e-12) continue;
      const double r = std::max(weights(i), 0.0) / direction(i);
      const auto k = static_cast<std::size_t>(i);
      const bool tie = leaves >= 0 && r == ratio;
      if (leaves < 0 || r < ratio || (tie && basis_[k] < basis_[static_cast<std::size_t>(leaves)]))
        leaves = i, ratio = r;
    }
    if (leaves < 0) return false;
    basis_[static_cast<std::size_t>(leaves)] = enters;
    sign_[static_cast<std::size_t>(leaves)] = sign;
    place(leaves);
    return true;
  }

  const Eigen::MatrixXd& phi_;
  std::vector<Eigen::Index> basis_;
  std::vector<double> sign_;
  Eigen::MatrixXd columns_;  // of the basis: (± φ, 1)
};

/// m + 2 samples that span: those which pivoting takes first, and the one farthest from them.
std::vector<Eigen::Index> spanning(const Eigen::MatrixXd& phi) {
  const Eigen::Index p = phi.cols();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(phi.transpose());
  std::vector<Eigen::Index> out;
  for (Eigen::Index i = 0; i <= p; ++i) out.push_back(qr.colsPermutation().indices()(i));
  return out;
}

}  // namespace

AffineFit fit_least_squares(const Eigen::MatrixXd& X, const Eigen::MatrixXd& values) {
  const Samples samples(X);
  const Eigen::RowVectorXd level = values.colwise().mean();
  const Eigen::MatrixXd moved = values.rowwise() - level;
  Eigen::MatrixXd c = samples.phi.colPivHouseholderQr().solve(moved);
  const Eigen::VectorXd rho = (moved - samples.phi * c).cwiseAbs().colwise().maxCoeff();
  c.row(0) += level;
  return samples.in_units(c, rho);
}

AffineFit fit_minimax(const Eigen::MatrixXd& X, const Eigen::MatrixXd& values) {
  const Samples samples(X);
  const Eigen::RowVectorXd level = values.colwise().mean();
  Eigen::MatrixXd rest = values.rowwise() - level;
  Eigen::MatrixXd c = samples.phi.colPivHouseholderQr().solve(rest);
  rest -= samples.phi * c;
  Eigen::VectorXd rho(values.cols());
  const std::vector<Eigen::Index> start = spanning(samples.phi);
  for (Eigen::Index i = 0; i < values.cols(); ++i) {
    Eigen::VectorXd more;
    rho(i) = Exchange(samples.phi, start).solve(rest.col(i), more);
    c.col(i) += more;
  }
  c.row(0) += level;
  return samples.in_units(c, rho);
}

}  // namespace surefix::raim
