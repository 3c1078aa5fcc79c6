// Any measurements through both switching filters: modes are probabilities, the estimate a number.
#include <cmath>

#include "bytes.hpp"
#include "switching/switching.hpp"

namespace {

using namespace surefix;
using switching::testing::Two;

template <switching::Method method>
void run(fuzz::Bytes bytes) {
  static const switching::testing::Prepared prepared;
  static const auto chain = switching::testing::four_modes();
  switching::Filter<method, Two> filter;
  fuzz::require(filter.make(chain, prepared.system.initial()) == ConfigStatus::ok, "a filter");
  while (bytes.more()) {
    switching::Measured<Two> z;
    z(0) = bytes.number(0.0, 2.0);
    (void)filter.step(prepared.transition(), prepared.observation(), z);
    double sum = 0.0;
    for (int j = 0; j < 4; ++j) {
      fuzz::require(filter.mode(j) >= 0.0, "a probability");
      sum += filter.mode(j);
    }
    fuzz::require(std::abs(sum - 1.0) < 1e-9, "modes sum to one");
    const auto& found = filter.estimate();
    fuzz::require(is_finite(found) && found.P(0, 1) == found.P(1, 0), "the estimate");
    // Far below the rounding of a determinant of two variances there is nothing to see.
    fuzz::require(
        found.P(0, 0) >= 0.0 && found.P(1, 1) >= 0.0 &&
            found.P(0, 1) * found.P(0, 1) <= (1.0 + 1e-14) * found.P(0, 0) * found.P(1, 1),
        "a covariance");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  run<switching::Method::imm>({data, size});
  run<switching::Method::one_step>({data, size});
  return 0;
}
