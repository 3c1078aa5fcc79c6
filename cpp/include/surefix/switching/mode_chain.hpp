// The finite Markov chain of the modes of a measurement (Sigalov & Oshman, section II).
//
// A mode carries γ, which multiplies what is measured of the state (1 healthy, 0 interrupted), and
// δ, which multiplies the noise's covariance. One chain covers the paper's Problems 1 to 4.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "surefix/core/status.hpp"

namespace surefix::switching {

/// γ and δ of a mode.
struct Mode {
  double gamma = 1.0;
  double delta = 1.0;
};

/// One density of the measurement in a mode: noise factor δ with this share of the mode.
struct Branch {
  double delta = 1.0;
  double share = 1.0;
};

/// What is wrong with a chain, and where.
struct ChainStatus {
  enum class What : std::uint8_t {
    ok = 0,
    wrong_size,  ///< not as many rows and columns as modes
    gamma,       ///< γ of mode `row` is not finite
    delta,       ///< δ of mode `row` is not > 0 and finite
    negative,    ///< an entry is negative or not finite
    row_sum,     ///< a row does not sum to one
    initial,     ///< the initial law has a negative entry or does not sum to one
    reducible,   ///< there is more than one stationary law
    lumped,      ///< mode `row` cannot be lumped: γ ≠ 0, or it is in no group, or in two
  } what = What::ok;
  int row = -1, column = -1;
  double value = 0.0;

  explicit operator bool() const noexcept { return what == What::ok; }
};

/// M modes, how they follow each other, and the law of the first one.
///
/// Rows of `transition` are the mode before, columns the mode after.
struct ModeChain {
  std::vector<double> gamma;                  // (M)
  std::vector<std::vector<Branch>> branches;  // (M), one each unless modes were lumped
  Eigen::MatrixXd transition;                 // (M × M)
  Eigen::VectorXd initial;                    // (M), of the mode at the first measurement

  [[nodiscard]] int size() const noexcept { return static_cast<int>(gamma.size()); }

  /// A chain of given modes; `initial` empty: the stationary law.
  [[nodiscard]] static ChainStatus make(const std::vector<Mode>& modes,
                                        const Eigen::MatrixXd& transition,
                                        const Eigen::VectorXd& initial, ModeChain& out);

  /// Problems 1 and 3: a chain of γ beside an independent one of δ; δ runs fastest. Draws that do
  /// not depend on the one before are a chain with equal rows.
  [[nodiscard]] static ChainStatus independent(const std::vector<double>& gamma,
                                               const Eigen::MatrixXd& gamma_transition,
                                               const std::vector<double>& delta,
                                               const Eigen::MatrixXd& delta_transition,
                                               ModeChain& out);

  /// Modes of γ = 0, whose estimate does not depend on δ, made one: its measurement has the mixed
  /// density of its members, its transitions are theirs, by the shares they have in `law`.
  ///
  /// Exact where the members' shares do not depend on what was before; `groups` holds the modes
  /// of every new mode.
  [[nodiscard]] ChainStatus lumped(const std::vector<std::vector<int>>& groups,
                                   const Eigen::VectorXd& law, ModeChain& out) const;
};

/// Whether P is a matrix of transitions between `size` modes; its rows are scaled to sum to one
/// exactly where they do to 1e-9.
[[nodiscard]] ChainStatus check_transition(Eigen::MatrixXd& P, int size);

/// The law p with pᵀP = pᵀ; `reducible` if there is more than one.
[[nodiscard]] ChainStatus stationary(const Eigen::MatrixXd& P, Eigen::VectorXd& law);

/// Transitions over dt ≥ 0 [s] of a chain with rates [1/s] (the diagonal is not read): e^{G dt}.
[[nodiscard]] ConfigStatus transition_over(const Eigen::MatrixXd& rates, double dt,
                                           Eigen::MatrixXd& P);

}  // namespace surefix::switching
