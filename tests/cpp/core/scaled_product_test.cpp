#include "surefix/core/scaled_product.hpp"

#include <gtest/gtest.h>

namespace surefix {
namespace {

TEST(ScaledProduct, NeitherUnderflowsNorOverflows) {
  ScaledProduct<double> product;
  double log_sum = 0.0;
  for (int i = 0; i < 10'000; ++i) {
    const double v = i % 2 == 0 ? 1e-30 : (i % 3 == 0 ? 1e90 : 1e-5);
    product.multiply(v);
    log_sum += std::log(v);
  }
  EXPECT_NEAR(product.log(0), log_sum, 1e-12 * std::fabs(log_sum));
}

TEST(ScaledProduct, TakesAnyFactorAtTheEdgeOfItsRange) {
  for (const double edge : {1e139, 1e-139})
    for (const double factor : {1e307, 1e-307}) {
      ScaledProduct<double> product;
      product.multiply(edge);
      product.multiply(factor);
      product.multiply(factor);
      const double expected = std::log(edge) + 2.0 * std::log(factor);
      EXPECT_NEAR(product.log(0), expected, 1e-13 * std::fabs(expected));
    }
}

TEST(ScaledProduct, LanesDoNotFeelEachOther) {
  ScaledProduct<Pack<4>> pack;
  std::array<ScaledProduct<double>, 4> alone;
  for (int i = 0; i < 1000; ++i) {
    const Pack<4> v(1e-3, 1.0 + 1e-3 * i, 1e120, 0.7);
    pack.multiply(v);
    for (int l = 0; l < 4; ++l) alone[static_cast<std::size_t>(l)].multiply(v(l));
  }
  for (int l = 0; l < 4; ++l)
    EXPECT_EQ(pack.log(l), alone[static_cast<std::size_t>(l)].log(0)) << l;
  ScaledProduct<double> copy;
  copy.copy_lane(0, pack, 2);
  EXPECT_EQ(copy.log(0), pack.log(2));
}

}  // namespace
}  // namespace surefix
