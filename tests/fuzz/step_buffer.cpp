// The step buffer against a sorted vector.
#include "surefix/desync/step_buffer.hpp"

#include <algorithm>
#include <vector>

#include "bytes.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace surefix;
  fuzz::Bytes bytes(data, size);
  desync::StepBuffer<16> buffer;
  std::vector<desync::Measurement> plain;
  for (std::int64_t id = 0; bytes.more(); ++id) {
    if (bytes.byte() % 8 == 0) {
      const Time until = bytes.byte();
      const std::size_t ready = buffer.ready(until);
      const auto first_after =
          std::find_if(plain.begin(), plain.end(), [&](const auto& m) { return m.valid > until; });
      fuzz::require(ready == static_cast<std::size_t>(first_after - plain.begin()), "ready");
      buffer.pop(ready);
      plain.erase(plain.begin(), first_after);
    } else {
      const desync::Measurement m{Time{bytes.byte()}, double(bytes.byte() % 4), id,
                                  bytes.byte() % 3};
      Status expected = Status::ok;
      if (plain.size() == 16) expected = Status::buffer_full;
      for (const auto& other : plain)
        if (repeats(m, other)) expected = Status::repeated;
      fuzz::require(buffer.push(m) == expected, "push");
      if (expected == Status::ok)
        plain.insert(std::upper_bound(plain.begin(), plain.end(), m, desync::before), m);
    }
    for (std::size_t i = 0; i < plain.size(); ++i)
      fuzz::require(buffer[i].id == plain[i].id, "the order");
  }
  return 0;
}
