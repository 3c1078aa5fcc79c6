// From what a sweep found of a fault to its likelihood ratio, amplitude and standard error.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <limits>

#include "surefix/drift/onset_sweep.hpp"

namespace surefix::drift {

/// Below this share of its information a fault hides in what the model itself can do: what is left
/// is the rounding of sums that cancel.
inline constexpr double detectable = 1e-9;

/// G = S₀ᵀ M S₀ (q × q), its inverse, and the share of the information that not knowing the state
/// leaves: the smallest eigenvalue of G against that of a known state. NaN: nothing is seen at all.
struct Detectability {
  Profile::Matrix gram;
  Profile::Matrix inverse;
  double share;
  [[nodiscard]] bool undetectable() const noexcept { return !(share > detectable); }
};

namespace detail {

/// The leading part of M, q × q, in one of a fixed size with ones behind it, where q is smaller.
template <int Q>
[[nodiscard]] Eigen::Matrix<double, Q, Q> padded(const Profile::Matrix& M) noexcept {
  Eigen::Matrix<double, Q, Q> out = Eigen::Matrix<double, Q, Q>::Identity();
  const int q = static_cast<int>(M.rows());
  for (int j = 0; j < q; ++j)
    for (int i = 0; i < q; ++i) out(i, j) = M(i, j);
  return out;
}

/// sᵀ M s, s the first column.
[[nodiscard]] inline double square(const Profile::Matrix& M, const Profile::Matrix& s) noexcept {
  double sum = 0.0;
  for (int j = 0; j < static_cast<int>(M.cols()); ++j)
    for (int i = 0; i < static_cast<int>(M.rows()); ++i) sum += s(i, 0) * M(i, j) * s(j, 0);
  return sum;
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
  if (!scale.allFinite()) return;
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

}  // namespace detail

[[nodiscard]] inline Detectability detectability(const Information& information,
                                                 const Profile::Matrix& onset) noexcept {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  if (onset.cols() == 1) {
    const double gram = detail::square(information.gram, onset);
    const double known = detail::square(information.known, onset);
    Detectability out{Profile::Matrix::Constant(1, 1, gram), Profile::Matrix::Constant(1, 1, none),
                      known > 0.0 ? gram / known : none};
    if (!out.undetectable()) out.inverse(0, 0) = 1.0 / gram;
    return out;
  }
  const Profile::Matrix MS = information.gram * onset, KS = information.known * onset;
  const Profile::Matrix known = onset.transpose() * KS;
  const auto q = onset.cols();
  Detectability out{onset.transpose() * MS, Profile::Matrix::Constant(q, q, none), none};
  if (q == 2) {
    detail::several<2>(out.gram, known, out);
  } else {
    detail::several<Profile::max_size>(out.gram, known, out);
  }
  return out;
}

/// numᵀ G⁻¹ num: the drop of 𝓛 when the best amplitude G⁻¹ num is subtracted, χ² with q degrees of
/// freedom when nothing is wrong.
template <class Numerator>
[[nodiscard]] double likelihood_ratio(const Profile::Matrix& inverse,
                                      const Numerator& num) noexcept {
  double sum = 0.0;
  for (int a = 0; a < static_cast<int>(inverse.rows()); ++a)
    for (int b = 0; b < static_cast<int>(inverse.cols()); ++b)
      sum += num(a) * inverse(a, b) * num(b);
  return sum;
}

}  // namespace surefix::drift
