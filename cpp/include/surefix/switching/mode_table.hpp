// A mode chain in the form that the steps read: no vectors of vectors, constants worked out.
#pragma once

#include <cmath>

#include "surefix/switching/mode_chain.hpp"
#include "surefix/switching/sizes.hpp"

namespace surefix::switching {

/// Modes and branches of a chain for measurements of m components. The transitions are not in it:
/// they may differ from step to step.
template <class S>
class ModeTable {
 public:
  ModeTable() = default;

  /// wrong_size if the chain has not S::M modes.
  [[nodiscard]] ConfigStatus make(const ModeChain& chain, int measured) {
    const int M = chain.size();
    if (M == 0 || (S::M != Eigen::Dynamic && M != S::M)) return ConfigStatus::wrong_size;
    resize(gamma_, M);
    resize(first_, M);
    resize(impossible_, M);
    resize(greatest_, M);
    resize(reads_, M);
    resize(fall_, M);
    branches_.clear();
    factors_.clear();
    for (int j = 0; j < M; ++j) {
      gamma_[at(j)] = chain.gamma[at(j)];
      reads_[at(j)] = chain.gamma[at(j)] != 0.0 ? 1 : 0;
      const bool enters = chain.initial(j) > 0.0 || (chain.transition.col(j).array() > 0.0).any();
      impossible_[at(j)] = enters ? 0.0 : 1.0;
      first_[at(j)] = static_cast<int>(branches_.size());
      greatest_[at(j)] = 0.0;
      for (const Branch& b : chain.branches[at(j)]) {
        if (b.delta > greatest_[at(j)]) greatest_[at(j)] = b.delta;
        branches_.push_back(b);
        for (int m = 0; m <= measured; ++m)
          factors_.push_back(b.share * std::pow(b.delta, -0.5 * m));
      }
      fall_[at(j)] = -0.5 / greatest_[at(j)];
    }
    stride_ = measured + 1;
    end_ = static_cast<int>(branches_.size());
    return ConfigStatus::ok;
  }

  [[nodiscard]] int size() const noexcept { return static_cast<int>(gamma_.size()); }
  [[nodiscard]] double gamma(int mode) const noexcept { return gamma_[at(mode)]; }
  /// Of a mode whose measurement depends on the state: there is one branch.
  [[nodiscard]] double delta(int mode) const noexcept { return greatest_[at(mode)]; }
  /// γ ≠ 0: the measurement depends on the state.
  [[nodiscard]] bool reads(int mode) const noexcept { return reads_[at(mode)] != 0; }
  /// −½ / δ, of the greatest δ.
  [[nodiscard]] double fall(int mode) const noexcept { return fall_[at(mode)]; }
  /// 1 for a mode that the chain never enters, else 0.
  [[nodiscard]] double impossible(int mode) const noexcept { return impossible_[at(mode)]; }
  /// The chain has other transitions, too, in which the mode may be entered.
  void allow(int mode) noexcept { impossible_[at(mode)] = 0.0; }
  /// Whether several δ share a mode.
  [[nodiscard]] bool lumped(int mode) const noexcept { return end(mode) - first(mode) > 1; }
  [[nodiscard]] bool any_lumped() const noexcept { return end_ > size(); }
  [[nodiscard]] int first(int mode) const noexcept { return first_[at(mode)]; }
  [[nodiscard]] int end(int mode) const noexcept {
    return mode + 1 < size() ? first_[at(mode + 1)] : end_;
  }
  [[nodiscard]] const Branch& branch(int b) const noexcept { return branches_[at(b)]; }
  /// share · δ^{-m/2}, m measured components.
  [[nodiscard]] double factor(int b, int m) const noexcept { return factors_[at(b * stride_ + m)]; }

 private:
  Bank<double, S::M> gamma_{};
  Bank<int, S::M> first_{};
  Bank<char, S::M> reads_{};
  Bank<double, S::M> impossible_{}, greatest_{}, fall_{};
  std::vector<Branch> branches_;
  std::vector<double> factors_;
  int end_ = 0, stride_ = 0;
};

}  // namespace surefix::switching
