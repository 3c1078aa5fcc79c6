// The course of a fault over time, from a small linear system: its value is c s with s' = A s, and
// s = S₀ a at the onset, where a is the unknown amplitude. A step, a ramp, an exponential approach
// and a sine of unknown phase are of this kind, and whatever else has an A.
#pragma once

#include <cmath>

#include "surefix/core/linear_model.hpp"

namespace surefix::drift {

/// At most four states p, and as many amplitudes q ≤ p.
class Profile {
 public:
  static constexpr int max_size = 4;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_size, max_size>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_size, 1>;

  /// `A` (p × p) [1/time], `output` c (p), `onset` S₀ (p × q) of full rank.
  [[nodiscard]] static ConfigStatus make(const Matrix& A, const Vector& output, const Matrix& onset,
                                         Profile& out) noexcept {
    const auto p = A.rows(), q = onset.cols();
    if (p == 0 || A.cols() != p || output.size() != p || onset.rows() != p || q == 0 || q > p)
      return ConfigStatus::wrong_size;
    if (!A.allFinite() || !output.allFinite() || !onset.allFinite())
      return ConfigStatus::not_finite;
    out.A_ = A;
    out.output_ = output;
    out.onset_ = onset;
    Matrix power = A;
    for (int k = 1; k < static_cast<int>(p); ++k) power = power * A;
    out.nilpotent_ = power.isZero(0.0);
    return ConfigStatus::ok;
  }
  /// 1 in one measurement only: an outlier. Its amplitude is what is wrong with it.
  [[nodiscard]] static Profile pulse() noexcept {
    Profile out;
    out.A_ = Matrix::Zero(1, 1);
    out.output_ = Vector::Ones(1);
    out.onset_ = Matrix::Ones(1, 1);
    out.lasts_ = false;
    return out;
  }

  [[nodiscard]] int size() const noexcept { return static_cast<int>(A_.rows()); }
  [[nodiscard]] int amplitudes() const noexcept { return static_cast<int>(onset_.cols()); }
  [[nodiscard]] const Vector& output() const noexcept { return output_; }
  [[nodiscard]] const Matrix& onset() const noexcept { return onset_; }

  /// e^{A elapsed}; exact where A is nilpotent (polynomials). False if it overflows.
  [[nodiscard]] bool transition(double elapsed, Matrix& out) const noexcept {
    const int p = size();
    out = Matrix::Identity(p, p);
    if (!lasts_) {
      out.setZero();
      return true;
    }
    if (nilpotent_) {
      Matrix term = out;
      for (int k = 1; k < p; ++k) {
        term = Matrix(term * A_) * (elapsed / k);
        out += term;
      }
      return out.allFinite();
    }
    return exponential(elapsed, out);
  }

 private:
  /// Taylor's series over a part so short that ‖A‖ h ≤ 1/4, squared until it is the whole.
  [[nodiscard]] bool exponential(double elapsed, Matrix& out) const noexcept {
    const double norm = A_.cwiseAbs().colwise().sum().maxCoeff() * std::abs(elapsed);
    if (!(norm < 1e30)) return false;
    const int halvings = norm > 0.25 ? std::ilogb(norm) + 3 : 0;
    const double h = std::ldexp(elapsed, -halvings);
    Matrix term = out;
    for (int k = 1; k <= 14; ++k) {  // (1/4)^14 / 14! < 1e-19
      term = Matrix(term * A_) * (h / k);
      out += term;
    }
    for (int k = 0; k < halvings; ++k) out = Matrix(out * out);
    return out.allFinite();
  }

  Matrix A_, onset_;
  Vector output_;
  bool nilpotent_ = true;
  bool lasts_ = true;
};

/// The transition over the time that was asked for last: in a regular log it is made once.
class ProfileStep {
 public:
  explicit ProfileStep(const Profile& profile) noexcept : profile_(profile) {}
  /// False if it overflows.
  [[nodiscard]] bool over(double elapsed) noexcept {
    if (elapsed == elapsed_) return true;
    elapsed_ = elapsed;
    return profile_.transition(elapsed, F_);
  }
  [[nodiscard]] const Profile::Matrix& F() const noexcept { return F_; }

 private:
  const Profile& profile_;
  double elapsed_ = std::numeric_limits<double>::quiet_NaN();
  Profile::Matrix F_;
};

}  // namespace surefix::drift
