// Any messages at any times through the step functions of the speed filter, the detector that
// watches it, and the mixture of fault hypotheses: only numbers come out, and all is counted.
#include <cmath>

#include "bytes.hpp"
#include "speed.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace surefix;
  using fuzz::require;
  static const fuzz::Speed made;  // what a program makes once
  fuzz::Bytes bytes(data, size);
  auto filter = made.filter();
  auto detector = made.detector();
  auto mixture = made.mixture();
  Time now = 0;
  long pushed = 0, asked = 0, mixture_failed = 0;
  while (bytes.more()) {
    if (bytes.byte() % 4 != 0) {
      const Time stamp = now + (bytes.byte() % 2 == 0 ? bytes.time() % 1'000'000'000 : 0);
      const std::int32_t sensor = bytes.byte() % 5 - 1;
      const double value = bytes.number(20.0, 5.0), factor = bytes.number(1.0, 0.1);
      (void)filter.push(stamp, sensor, value, pushed, factor);
      (void)mixture.push(stamp, sensor, value, pushed, factor);
      ++pushed;
      continue;
    }
    Time next = 0;
    if (__builtin_add_overflow(now, bytes.time(), &next)) next = now;
    desync::StepError error;
    const Status status = filter.estimate(next, error);
    ++asked;
    require(is_finite(filter.state().belief), "the belief is finite");
    const auto& P = filter.state().belief.P;
    require(P(0, 1) == P(1, 0) && P(0, 0) >= 0.0 && P(1, 1) >= 0.0, "P is a covariance");
    require(std::isfinite(filter.state().likelihood.value()), "the likelihood is a number");
    if (status == Status::ok) {
      detector.take(filter);
      const auto found = detector.look(0);
      require(found.p_bound >= 0.0 && found.p_bound <= 1.0, "a probability");
      now = next;
    }
    robust::RobustEstimate e;
    if (mixture.estimate(next, e) != Status::ok) {
      ++mixture_failed;
      continue;
    }
    require(std::isfinite(e.x[0]) && e.P[0] >= 0.0 && e.P[1] == e.P[2], "the mixture's moments");
    require(e.lower <= e.upper, "limits");
    require(e.discarded >= 0.0 && e.discarded <= 1.0, "what was cut off");
  }
  long counted = 0;
  for (const std::int64_t count : filter.counters().all()) counted += count;
  require(counted >= pushed && counted <= pushed + asked, "every message is counted");
  counted = 0;
  for (const std::int64_t count : mixture.counters().all()) counted += count;
  require(counted == pushed + mixture_failed, "every message of the mixture is counted");
  return 0;
}
