#include "surefix/core/exponential.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace surefix {
namespace {

TEST(Exponential, IsRightToTheLastPlace) {
  double worst = 0.0;
  for (int i = 0; i <= 400'000; ++i) {
    const double v = -700.0 + 1400.0 * i / 400'000 + 1e-7 * (i % 13);
    if (v > 700.0) continue;
    const long double truth = std::exp(static_cast<long double>(v));
    const double value = exponential(v);
    const double unit = std::nextafter(value, 2.0 * value) - value;
    worst = std::max(worst, static_cast<double>(std::fabs(value - truth)) / unit);
  }
  EXPECT_LT(worst, 1.1);
  EXPECT_GT(worst, 0.5);  // else it was not measured
  EXPECT_EQ(exponential(0.0), 1.0);
  EXPECT_EQ(exponential(-0.0), 1.0);
}

TEST(Exponential, StopsAtMinusSevenHundred) {
  EXPECT_EQ(exponential(-1e300), exponential(-700.0));
  EXPECT_EQ(exponential(-HUGE_VAL), exponential(-700.0));
  EXPECT_GT(exponential(-700.0), 0.0);
}

TEST(Exponential, OfAPackHasTheBitsOfEach) {
  for (double first = -720.0; first < 5.0; first += 0.37) {
    Pack<8> pack;
    for (int i = 0; i < 8; ++i) pack(i) = first + 0.1 * i;
    const Pack<8> result = exponential(pack);
    for (int i = 0; i < 8; ++i) EXPECT_EQ(result(i), exponential(pack(i)));
  }
}

}  // namespace
}  // namespace surefix
