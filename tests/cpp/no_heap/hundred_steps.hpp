// What can happen in a hundred steps of a filter.
#pragma once

#include "surefix/desync/filter.hpp"
#include "systems.hpp"

namespace surefix::no_heap {

using namespace surefix::test;

/// Estimates, late and refused measurements.
template <class Estimate, class F, class System>
bool hundred_steps(F& filter, const System& system, Random& random) {
  bool ok = true;
  Time time = 0;
  for (int step = 0; step < 100; ++step) {
    for (int i = 0; i < 20; ++i) {
      const Time stamp = time + 200 * millisecond + random.integer(200) * millisecond;
      const Status status = filter.push(stamp, random.integer(system.sensor_count()),
                                        20.0 + random.normal(), 20 * step + i);
      ok = ok && (status == Status::ok || status == Status::repeated);
    }
    ok = ok && filter.push(time - second, 0, 20.0, 0) == Status::too_late;
    ok = ok && filter.push(time + 1, system.sensor_count(), 20.0, 0) == Status::unknown_sensor;
    ok = ok && filter.push(time + 1, 0, std::nan(""), 0) == Status::not_finite;
    time += 400 * millisecond;
    Estimate estimate;
    ok = ok && filter.estimate(time, estimate) == Status::ok;
    ok = ok && filter.estimate(time - second, estimate) == Status::time_backwards;
  }
  return ok;
}

}  // namespace surefix::no_heap
