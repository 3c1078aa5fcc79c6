// From what a sweep found of a fault to its likelihood ratio, amplitude and standard error.
#pragma once

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

/// sᵀ M s, s the first column.
[[nodiscard]] inline double square(const Profile::Matrix& M, const Profile::Matrix& s) noexcept {
  double sum = 0.0;
  for (int j = 0; j < static_cast<int>(M.cols()); ++j)
    for (int i = 0; i < static_cast<int>(M.rows()); ++i) sum += s(i, 0) * M(i, j) * s(j, 0);
  return sum;
}

/// Share and inverse of two or more amplitudes; undetectable: as `out` is.
void several_amplitudes(const Profile::Matrix& gram, const Profile::Matrix& known,
                        Detectability& out) noexcept;

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
  detail::several_amplitudes(out.gram, known, out);
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
