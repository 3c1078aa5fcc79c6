// A forward record of any system, and what the detectors ask of it, for sizes known at run time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "surefix/core/any_system.hpp"
#include "surefix/core/large_array.hpp"
#include "surefix/core/linear_system.hpp"
#include "surefix/desync/sorted_log.hpp"
#include "surefix/drift/profile.hpp"
#include "surefix/drift/system_pass.hpp"

namespace surefix::drift {

/// A fault that is searched for: its course, and the weight of every channel in it.
struct Search {
  Profile profile;
  std::vector<double> direction;
};

/// What the data do not change about K possible onsets: in arrays that are as long as the record,
/// of which the last K count.
struct Onsets {
  LargeArray<std::int64_t> measurement;  // index in the record
  LargeArray<double> inverse;            // (·, q, q) G⁻¹: covariance of the amplitudes
  LargeArray<double> share;              // `Detectability::share`
  std::size_t count;                     // K
};

/// Numbers of one or many runs: (runs, size of the record), row by row.
struct Values {
  const double* data;
  std::int64_t first, last;  // runs of them that are meant
};

/// Angular frequencies `first` to `last` − 1 of F.
struct FrequencyRange {
  const double* omega;
  std::size_t F, first, last;
};
struct SpectrumOutput {
  double* inverse;    ///< (F, 2, 2) G⁻¹
  double* share;      ///< (F) as of an onset
  double* numerator;  ///< (runs, F, 2) of cos and sin
};

class AnyRecord {
 public:
  virtual ~AnyRecord() = default;

  /// Null with a status if the filter fails.
  [[nodiscard]] static std::unique_ptr<AnyRecord> of(const LinearSystem& system,
                                                     const SystemData& data, Status& status);
  /// `status`: of every row of the log.
  [[nodiscard]] static std::unique_ptr<AnyRecord> of(const AnySystem& system,
                                                     const AnySystem::ModelBelief& initial,
                                                     std::optional<Time> start,
                                                     const desync::LogView& log, Status* status);

  [[nodiscard]] virtual std::size_t size() const noexcept = 0;
  [[nodiscard]] virtual int channels() const noexcept = 0;
  [[nodiscard]] virtual std::int64_t id(std::size_t i) const noexcept = 0;
  /// 1/S.
  [[nodiscard]] virtual double inverse(std::size_t i) const noexcept = 0;
  /// Variance of its own noise.
  [[nodiscard]] virtual double noise(std::size_t i) const noexcept = 0;
  /// How much it has of a fault in `direction`.
  [[nodiscard]] virtual double weight(std::size_t i, const double* direction) const noexcept = 0;
  /// Whether the noise of the channels is correlated, so that measurements mix them.
  [[nodiscard]] virtual bool mixed() const noexcept = 0;

  /// (Γ⁻¹γ)_i of each run into `out` (runs, size).
  virtual void whiten(const Values& innovations, double* out) const noexcept = 0;
  /// (Γ⁻¹)_ii into `out` (size).
  virtual void precision(double* out) const noexcept = 0;
  /// False if the profile overflows.
  [[nodiscard]] virtual bool onsets(const Search& search, Onsets& out) const = 0;
  /// S₀ᵀℓ of every onset into `out` (runs, K, q).
  [[nodiscard]] virtual bool scan(const Search& search, const Values& innovations,
                                  std::size_t onsets, double* out) const noexcept = 0;
  /// Innovations of a fault of unit amplitude that begins at `measurement`: (q, size).
  [[nodiscard]] virtual bool response(const Search& search, std::size_t measurement,
                                      double* out) const noexcept = 0;
  virtual void spectrum(const std::vector<double>& direction, const FrequencyRange& range,
                        const Values& innovations, const SpectrumOutput& out) const = 0;
  /// Innovations of cos ωt and of sin ωt: (2, size).
  virtual void wave(const std::vector<double>& direction, double omega,
                    double* out) const noexcept = 0;

  LargeArray<double> innovations;      ///< (runs, size)
  std::vector<double> log_likelihood;  ///< (runs)
};

}  // namespace surefix::drift
