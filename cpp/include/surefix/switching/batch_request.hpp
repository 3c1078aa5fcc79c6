// Many series of one length through one filter: what is asked for, where it is written, and how the
// series are taken: packs of eight side by side, time outermost.
#pragma once

#include <algorithm>
#include <cstdint>

#include "surefix/core/status.hpp"
#include "surefix/switching/state.hpp"

namespace surefix::switching {

/// Series `first` to `last` − 1 of arrays in C order.
struct BatchRequest {
  const double* z;            ///< (runs, T, m), NaN: missing
  const std::int32_t* modes;  ///< (runs, T) of a genie that knows them; null: all healthy
  std::int64_t first, last;
  int T;
};

/// Where a batch writes; null: not wanted.
struct BatchOutput {
  double* x;               ///< (runs, T, n)
  double* P;               ///< (runs, T, n, n)
  double* mode;            ///< (runs, T, M)
  double* log_likelihood;  ///< (runs)
};

/// How it went: a status, and the run and step at which it is not ok.
struct BatchStatus {
  Status status = Status::ok;
  std::int64_t run = -1;
  int step = -1;
};

namespace detail {

inline constexpr int width = 8;  // series in a pack

/// All lanes of `to` ← the same belief.
template <class To, class From>
void spread(To& to, const From& from) noexcept {
  for (int l = 0; l < Lanes<typename To::Scalar>::count; ++l) copy_lane(to, l, from, 0);
}

/// Packs of the range, then what remains of it: alone, or as a pack that is not full.
template <class Together, class Alone>
BatchStatus over_runs(const BatchRequest& in, Together&& together, Alone&& alone) {
  std::int64_t run = in.first;
  BatchStatus status;
  for (; in.last - run >= 3 && status.status == Status::ok; run += width)
    status = together(run, static_cast<int>(std::min<std::int64_t>(width, in.last - run)));
  for (; run < in.last && status.status == Status::ok; ++run) status = alone(run);
  return status;
}

}  // namespace detail

}  // namespace surefix::switching
