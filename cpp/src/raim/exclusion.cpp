#include "surefix/raim/exclusion.hpp"

#include <cmath>

namespace surefix::raim {
namespace {

constexpr double unseen = 1e-10;  // of a pivot: the residual shows nothing more

/// All sets of one size, depth first; a satellite more is a row more of the Cholesky factor of
/// (I − P)_JJ.
class Search {
 public:
  Search(const Geometry& geometry, const double* r, int size) noexcept
      : geometry_(geometry), r_(r), size_(size) {}

  /// Tries every satellite from `first` on as member D.
  template <std::size_t D>
  void extend(int first, double explained) noexcept {
    if (size_ == static_cast<int>(D)) {
      if (explained > most_) most_ = explained, best_ = set_, best_.size = size_;
      return;
    }
    if constexpr (D < max_set) {
      for (int i = first; i <= geometry_.size() - (size_ - static_cast<int>(D)); ++i) {
        double pivot = geometry_.seen(i, i), rest = r_[i];
        for (std::size_t k = 0; k < D; ++k) {
          double entry = geometry_.seen(set_.member[k], i);
          for (std::size_t j = 0; j < k; ++j) entry -= factor_[k][j] * factor_[D][j];
          entry /= factor_[k][k];
          factor_[D][k] = entry;
          pivot -= entry * entry;
          rest -= entry * solved_[k];
        }
        if (pivot <= unseen) continue;
        factor_[D][D] = std::sqrt(pivot);
        solved_[D] = rest / factor_[D][D];
        set_.member[D] = i;
        extend<D + 1>(i + 1, explained + solved_[D] * solved_[D]);
      }
    }
  }
  [[nodiscard]] const SatelliteSet& best() const noexcept { return best_; }

 private:
  const Geometry& geometry_;
  const double* r_;
  int size_;
  double most_ = -1.0;
  SatelliteSet set_, best_;
  std::array<std::array<double, max_set>, max_set> factor_{};
  std::array<double, max_set> solved_{};
};

}  // namespace

SatelliteSet best_exclusion(const Geometry& geometry, const double* r, int size) noexcept {
  Search search(geometry, r, size);
  search.extend<0>(0, 0.0);
  return search.best();
}

}  // namespace surefix::raim
