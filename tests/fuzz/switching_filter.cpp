// Any measurements through both switching filters: modes are probabilities, the estimate a number.
#include <cmath>

#include "bytes.hpp"
#include "surefix/core/linear_system.hpp"
#include "surefix/switching/filter.hpp"

namespace {

using namespace surefix;
using Sizes = switching::Sizes<2, 4>;

switching::ModeChain four_modes() {
  Eigen::MatrixXd gamma(2, 2), delta(2, 2);
  gamma << 0.9, 0.1, 0.6, 0.4;
  delta << 0.8, 0.2, 0.5, 0.5;
  switching::ModeChain chain;
  fuzz::require(static_cast<bool>(switching::ModeChain::independent({1.0, 0.0}, gamma, {1.0, 10.0},
                                                                    delta, chain)),
                "a chain");
  return chain;
}
PreparedSystem<Sizes> prepared() {
  LinearSystem system;
  system.A = {(Eigen::Matrix2d() << 1.0, 0.5, -0.2, 0.7).finished()};
  system.Q = {Eigen::Vector2d(0.3, 0.1).asDiagonal().toDenseMatrix()};
  system.H = {(Eigen::MatrixXd(1, 2) << 1.0, 0.3).finished()};
  system.R = {Eigen::MatrixXd::Constant(1, 1, 0.5)};
  system.x0 = Eigen::Vector2d(1.0, -1.0);
  system.P0 = Eigen::Vector2d(2.0, 1.0).asDiagonal();
  PreparedSystem<Sizes> out;
  fuzz::require(out.make(system) == ConfigStatus::ok, "a system");
  return out;
}

template <switching::Method method>
void run(fuzz::Bytes bytes) {
  static const auto system = prepared();
  static const auto chain = four_modes();
  switching::Filter<method, Sizes> filter;
  fuzz::require(filter.make(chain, system.initial()) == ConfigStatus::ok, "a filter");
  while (bytes.more()) {
    switching::Measured<Sizes> z;
    z(0) = bytes.number(0.0, 2.0);
    (void)filter.step(system.transition(1), system.observation(0), z);
    double sum = 0.0;
    for (int j = 0; j < 4; ++j) {
      fuzz::require(filter.mode(j) >= 0.0, "a probability");
      sum += filter.mode(j);
    }
    fuzz::require(std::abs(sum - 1.0) < 1e-9, "modes sum to one");
    const auto& found = filter.estimate();
    fuzz::require(is_finite(found) && found.P(0, 0) >= 0.0 && found.P(0, 1) == found.P(1, 0),
                  "the estimate");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  run<switching::Method::imm>({data, size});
  run<switching::Method::one_step>({data, size});
  return 0;
}
