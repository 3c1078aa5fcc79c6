// What became of the messages: nothing is lost silently.
#pragma once

#include <cstdio>
#include <surefix/core/status.hpp>

/// Writes each status that measurements had, with their number, and that of lines that were none.
inline void print(const surefix::Counters& counters, long long bad_lines) {
  for (int s = 0; s < surefix::status_count; ++s) {
    const auto status = static_cast<surefix::Status>(s);
    if (counters[status] > 0)
      std::printf("%s,%lld\n", surefix::name(status), static_cast<long long>(counters[status]));
  }
  if (bad_lines > 0) std::printf("bad_line,%lld\n", bad_lines);
}
