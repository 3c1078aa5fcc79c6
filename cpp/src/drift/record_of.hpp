// The record of N states, or of any number.
#pragma once

#include <algorithm>

#include "surefix/core/log_likelihood.hpp"
#include "surefix/drift/any_record.hpp"
#include "surefix/drift/likelihood_ratio.hpp"
#include "surefix/drift/log_pass.hpp"
#include "surefix/drift/spectrum_sweep.hpp"

namespace surefix::drift {

/// Runs side by side in a pack.
inline constexpr int width = 8;

/// f(first run, lanes, Lane) over a range of runs: packs, then what remains.
template <class F>
void over_runs(const Values& values, F&& f) {
  std::int64_t run = values.first;
  for (; values.last - run >= 3; run += width)
    f(run, static_cast<int>(std::min<std::int64_t>(width, values.last - run)), Pack<width>());
  for (; run < values.last; ++run) f(run, 1, double{});
}

/// The innovations of measurement i in every lane; lanes beyond the last repeat it.
template <class Lane>
SUREFIX_INLINE Lane gather(const double* data, std::size_t size, std::int64_t run, int lanes,
                           std::size_t i) noexcept {
  Lane out;
  for (int l = 0; l < Lanes<Lane>::count; ++l)
    Lanes<Lane>::set(out, l,
                     data[static_cast<std::size_t>(run + std::min(l, lanes - 1)) * size + i]);
  return out;
}

template <int N, int MaxN>
class RecordOf final : public AnyRecord {
  using Record = ForwardRecord<N, MaxN>;

 public:
  RecordOf(int n, int channels, std::size_t capacity) : record(n, channels, capacity) {}

  Record record;

  std::size_t size() const noexcept override { return record.size(); }
  std::int64_t id(std::size_t i) const noexcept override { return record.id(i); }
  int channels() const noexcept override { return record.channels(); }
  double inverse(std::size_t i) const noexcept override { return record[i].inverse; }
  double noise(std::size_t i) const noexcept override { return record[i].noise; }
  double weight(std::size_t i, const double* direction) const noexcept override {
    return record.weight(i, direction);
  }
  bool mixed() const noexcept override { return record.mixed(); }

  void whiten(const Values& values, double* out) const noexcept override {
    const std::size_t count = record.size();
    over_runs(values, [&](std::int64_t run, int lanes, auto kind) {
      using Lane = decltype(kind);
      typename Gaussian<N, Lane, MaxN>::Vector lambda(record.state_size());
      for (int i = 0; i < record.state_size(); ++i) lambda(i) = Lanes<Lane>::all(0.0);
      for (std::size_t i = count; i-- > 0;) {
        const auto measurement = record[i];
        const Lane w =
            desync::sweep_mean<N>(lambda, measurement.h(), measurement.gain, measurement.inverse,
                                  gather<Lane>(values.data, count, run, lanes, i));
        for (int l = 0; l < lanes; ++l)
          out[static_cast<std::size_t>(run + l) * count + i] = Lanes<Lane>::get(w, l);
        if (measurement.elapsed > 0.0) measurement.transition.apply_transposed(lambda);
      }
    });
  }

  void precision(double* out) const noexcept override {
    const int n = record.state_size();
    typename Record::Belief::Matrix Lambda = Record::Belief::Matrix::Zero(n, n);
    typename Record::Belief::Vector m = Record::Belief::Vector::Zero(n);
    for (std::size_t i = record.size(); i-- > 0;) {
      const auto measurement = record[i];
      out[i] = desync::sweep_precision<N>(Lambda, measurement.h(), measurement.gain,
                                          measurement.inverse, m);
      if (measurement.elapsed > 0.0) propagate_transposed(Lambda, measurement.transition);
    }
  }

  bool onsets(const Search& search, Onsets& out) const override {
    const Profile& profile = search.profile;
    const double* direction = search.direction.data();
    const auto qq = static_cast<std::size_t>(profile.amplitudes() * profile.amplitudes());
    std::size_t place = record.size();
    out = {LargeArray<std::int64_t>(place), LargeArray<double>(place * qq),
           LargeArray<double>(place), 0};
    InformationSweep<Record> sweep(record.state_size(), profile.size());
    return onset_sweep(
        record, profile, direction,
        [&](const auto& measurement, std::size_t, double weight) {
          sweep.take(measurement, weight, profile.output());
        },
        [&](std::size_t i) {
          const Detectability found = detectability(sweep.now(), profile.onset());
          out.measurement[--place] = static_cast<std::int64_t>(i);
          out.share[place] = found.share;
          std::copy_n(found.inverse.data(), qq, &out.inverse[place * qq]);
          ++out.count;
        },
        [&](const auto& measurement, const auto& A) { sweep.move(measurement, A); });
  }

  bool scan(const Search& search, const Values& values, std::size_t onsets,
            double* out) const noexcept override {
    const Profile& profile = search.profile;
    const auto q = static_cast<std::size_t>(profile.amplitudes());
    bool good = true;
    over_runs(values, [&](std::int64_t run, int lanes, auto kind) {
      using Lane = decltype(kind);
      SignalSweep<Record, Lane> sweep(record.state_size(), profile.size());
      std::size_t onset = onsets;
      good &= onset_sweep(
          record, profile, search.direction.data(),
          [&](const auto& measurement, std::size_t i, double weight) {
            sweep.take(measurement, weight, profile.output(),
                       gather<Lane>(values.data, record.size(), run, lanes, i));
          },
          [&](std::size_t) {
            const auto numerator = sweep.numerator(profile.onset());
            --onset;
            for (int l = 0; l < lanes; ++l)
              for (std::size_t a = 0; a < q; ++a)
                out[(static_cast<std::size_t>(run + l) * onsets + onset) * q + a] =
                    Lanes<Lane>::get(numerator(static_cast<int>(a)), l);
          },
          [&](const auto& measurement, const auto& A) { sweep.move(measurement, A); });
    });
    return good;
  }

  bool response(const Search& search, std::size_t measurement,
                double* out) const noexcept override {
    return onset_response(record, search.profile, search.direction.data(), measurement, out);
  }

  void spectrum(const std::vector<double>& direction, const FrequencyRange& range,
                const Values& values, const SpectrumOutput& to) const override {
    constexpr std::size_t side = frequencies_at_once;
    const auto runs = static_cast<std::size_t>(values.last - values.first);
    const std::size_t F = range.F;
    std::vector<Frequencies> num(2 * runs);
    for (std::size_t f = range.first; f < range.last; f += side) {
      Frequencies own;
      for (std::size_t l = 0; l < side; ++l)
        own(static_cast<int>(l)) = range.omega[std::min(f + l, range.last - 1)];
      for (auto& n : num) n.setZero();
      std::array<Frequencies, 6> sums;  // Σ ρρ/S: cc, cs, ss; and the same of a known state
      for (auto& sum : sums) sum.setZero();
      spectrum_sweep(record, direction.data(), own,
                     [&](std::size_t i, const auto& measurement, const Frequencies& rc,
                         const Frequencies& rs, const Frequencies& dc, const Frequencies& ds) {
                       const Frequencies c = rc * measurement.inverse, s = rs * measurement.inverse;
                       sums[0] += rc * c;
                       sums[1] += rc * s;
                       sums[2] += rs * s;
                       const double r = 1.0 / measurement.noise;
                       sums[3] += dc * dc * r;
                       sums[4] += dc * ds * r;
                       sums[5] += ds * ds * r;
                       const double* own_values =
                           values.data + static_cast<std::size_t>(values.first) * record.size() + i;
                       for (std::size_t k = 0; k < runs; ++k) {
                         const double nu = own_values[k * record.size()];
                         num[2 * k] += c * nu;
                         num[2 * k + 1] += s * nu;
                       }
                     });
      for (std::size_t l = 0; l < std::min(side, range.last - f); ++l) {
        const int lane = static_cast<int>(l);
        write_information(sums, lane, to.inverse + 4 * (f + l), to.share + f + l);
        for (std::size_t k = 0; k < runs; ++k)
          for (std::size_t a = 0; a < 2; ++a)
            to.numerator[((static_cast<std::size_t>(values.first) + k) * F + f + l) * 2 + a] =
                num[2 * k + a](lane);
      }
    }
  }

  void wave(const std::vector<double>& direction, double omega,
            double* out) const noexcept override {
    spectrum_sweep(record, direction.data(), Frequencies::Constant(omega),
                   [&](std::size_t i, const auto&, const Frequencies& rc, const Frequencies& rs,
                       const Frequencies&, const Frequencies&) {
                     out[i] = rc(0);
                     out[record.size() + i] = rs(0);
                   });
  }

 private:
  static void write_information(const std::array<Frequencies, 6>& sums, int lane, double* inverse,
                                double* share) {
    const auto matrix = [&](std::size_t at) {
      Profile::Matrix M(2, 2);
      M << sums[at](lane), sums[at + 1](lane), sums[at + 1](lane), sums[at + 2](lane);
      return M;
    };
    const Detectability found =
        detectability({matrix(0), matrix(3)}, Profile::Matrix::Identity(2, 2));
    std::copy_n(found.inverse.data(), 4, inverse);
    *share = found.share;
  }
};

}  // namespace surefix::drift
