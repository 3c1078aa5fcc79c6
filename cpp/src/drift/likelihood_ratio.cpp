#include "surefix/drift/likelihood_ratio.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace surefix::drift {
namespace {

/// The leading part of M, q × q, in one of a fixed size with ones behind it, where q is smaller.
template <int Q>
[[nodiscard]] Eigen::Matrix<double, Q, Q> padded(const Profile::Matrix& M) noexcept {
  Eigen::Matrix<double, Q, Q> out = Eigen::Matrix<double, Q, Q>::Identity();
  const int q = static_cast<int>(M.rows());
  for (int j = 0; j < q; ++j)
    for (int i = 0; i < q; ++i) out(i, j) = M(i, j);
  return out;
}

/// Share and inverse of several amplitudes at once, Q ≥ q. The ones behind them have a share of 1.
template <int Q>
void several(const Profile::Matrix& gram, const Profile::Matrix& known,
             Detectability& out) noexcept {
  using Square = Eigen::Matrix<double, Q, Q>;
  // What is smaller by 20 decades than another's information is the rounding of zero, as of a sine
  // at half the sampling rate.
  const auto own = known.diagonal();
  if (!(own.minCoeff() > 1e-20 * own.maxCoeff())) return;
  Square G = padded<Q>(gram), K = padded<Q>(known);
  // In units in which every amplitude is known equally well, so that units do not matter.
  const Eigen::Matrix<double, Q, 1> scale = K.diagonal().cwiseSqrt().cwiseInverse();
  G = scale.asDiagonal() * G * scale.asDiagonal();
  K = scale.asDiagonal() * K * scale.asDiagonal();
  const Eigen::LLT<Square> factor(K);
  const Square L = factor.matrixL();
  // Amplitudes that a known state itself tells apart by rounding only are not told apart.
  const double apart = L.diagonal().minCoeff();
  if (factor.info() != Eigen::Success || !(apart * apart > detectable)) return;
  Square part = L.template triangularView<Eigen::Lower>().solve(G);
  part = L.template triangularView<Eigen::Lower>().solve(Square(part.transpose()));
  const Eigen::SelfAdjointEigenSolver<Square> solver(part, Eigen::EigenvaluesOnly);
  const double share = solver.eigenvalues()(0);
  const Eigen::LLT<Square> inverse(G);
  if (!(share > detectable) || inverse.info() != Eigen::Success) return;
  Square all = inverse.solve(Square::Identity());
  all = scale.asDiagonal() * all * scale.asDiagonal();
  out.share = share;
  for (int j = 0; j < static_cast<int>(gram.rows()); ++j)
    for (int i = 0; i < static_cast<int>(gram.rows()); ++i) out.inverse(i, j) = all(i, j);
}

}  // namespace

namespace detail {

void several_amplitudes(const Profile::Matrix& gram, const Profile::Matrix& known,
                        Detectability& out) noexcept {
  if (gram.rows() == 2) {
    several<2>(gram, known, out);
  } else {
    several<Profile::max_size>(gram, known, out);
  }
}

}  // namespace detail
}  // namespace surefix::drift
