#include "surefix/desync/composite_matrices.hpp"

#include <Eigen/LU>

namespace surefix::desync {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

Index components(const std::vector<Observation>& observations) {
  Index M = 0;
  for (const Observation& observation : observations) M += observation.H.rows();
  return M;
}

Index signed_size(const std::vector<Leg>& legs) { return static_cast<Index>(legs.size()); }

}  // namespace

CompositeMatrices composite_matrices(const std::vector<Leg>& legs,
                                     const std::vector<Observation>& observations) {
  const Index n = legs[0].F.rows(), p = legs[0].G.cols(), count = signed_size(legs);
  const Index M = components(observations);
  CompositeMatrices out;
  out.Omega = MatrixXd::Zero(n * count, n * count);
  out.Upsilon = MatrixXd::Zero(M, M);
  out.J = MatrixXd::Zero(M, p * count);
  out.HF = MatrixXd::Zero(M, n);
  out.L = MatrixXd::Zero(M, n * count);
  out.LG = MatrixXd::Zero(M, p * count);

  // What reaches the present time from x_{k−1} and from each ω_j: products of the legs so far.
  MatrixXd from_start = MatrixXd::Identity(n, n);
  MatrixXd from_noise = MatrixXd::Zero(n, n * count);  // after the last leg this is W
  MatrixXd from_input = MatrixXd::Zero(n, p * count);  // and this G
  Index row = 0;
  for (Index i = 0; i < count; ++i) {
    const Leg& leg = legs[static_cast<std::size_t>(i)];
    from_start = leg.F * from_start;
    from_noise = leg.F * from_noise;
    from_input = leg.F * from_input;
    from_noise.middleCols(n * i, n).setIdentity();
    if (p > 0) from_input.middleCols(p * i, p) = leg.G;
    out.Omega.block(n * i, n * i, n, n) = leg.Q;
    if (i + 1 == count) break;
    const Observation& observation = observations[static_cast<std::size_t>(i)];
    const Index m = observation.H.rows();
    out.HF.middleRows(row, m) = observation.H * from_start;
    out.L.middleRows(row, m) = observation.H * from_noise;
    out.Upsilon.block(row, row, m, m) = observation.R;
    if (p > 0) {  // else these matrices are empty
      out.LG.middleRows(row, m) = observation.H * from_input;
      out.J.block(row, p * i, m, p) = observation.J;
    }
    row += m;
  }
  out.F = from_start;
  out.W = from_noise;
  out.G = from_input;
  return out;
}

bool backward_matrices(const std::vector<Leg>& legs, const std::vector<Observation>& observations,
                       const CompositeMatrices& matrices, BackwardMatrices& out) {
  const Index n = legs[0].F.rows(), p = legs[0].G.cols(), count = signed_size(legs);
  const Index M = components(observations);
  out.H = MatrixXd::Zero(M, n);
  out.Theta = MatrixXd::Zero(M, n * count);
  out.Xi = MatrixXd::Zero(M, p * count);
  Index row = 0;
  for (Index i = 0; i + 1 < count; ++i) {
    const Observation& observation = observations[static_cast<std::size_t>(i)];
    const Index m = observation.H.rows();
    MatrixXd back = observation.H;  // H_i (F_j…F_{i+1})⁻¹
    for (Index j = i + 1; j < count; ++j) {
      const Leg& leg = legs[static_cast<std::size_t>(j)];
      const Eigen::FullPivLU<MatrixXd> lu(leg.F.transpose());
      if (!lu.isInvertible()) return false;
      back = MatrixXd(lu.solve(back.transpose())).transpose().eval();
      out.Theta.block(row, n * j, m, n) = back;
      if (p > 0) out.Xi.block(row, p * j, m, p) = back * leg.G;
    }
    out.H.middleRows(row, m) = back;
    row += m;
  }
  out.Jtilde = matrices.J - out.Xi;
  return true;
}

}  // namespace surefix::desync
