#include "surefix/switching/mode_chain.hpp"

#include <cmath>

#include "surefix/core/rate_chain.hpp"

namespace surefix::switching {
namespace {

using What = ChainStatus::What;

constexpr double rounding = 1e-9;  // that the sum of a law may be away from one

/// Whether a row is a law; scales it to sum to one.
template <class Row>
ChainStatus check_law(Row&& row, int index, What unsummed) {
  double sum = 0.0;
  for (int j = 0; j < static_cast<int>(row.size()); ++j) {
    if (!std::isfinite(row(j)) || row(j) < 0.0) return {What::negative, index, j, row(j)};
    sum += row(j);
  }
  if (!(std::abs(sum - 1.0) <= rounding)) return {unsummed, index, -1, sum};
  if (sum != 1.0) row /= sum;
  return {};
}

/// The modes that are never left together; empty if there are two such classes.
std::vector<int> closed_class(const Eigen::MatrixXd& P) {
  const int M = static_cast<int>(P.rows());
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> reaches = P.array() > 0.0;
  for (int i = 0; i < M; ++i) reaches(i, i) = true;
  for (int k = 0; k < M; ++k)
    for (int i = 0; i < M; ++i)
      if (reaches(i, k)) reaches.row(i) = reaches.row(i) || reaches.row(k);
  for (int i = 0; i < M; ++i) {
    if (!reaches.col(i).all()) continue;  // not reached by all: transient, or not the only class
    std::vector<int> members;
    for (int j = 0; j < M; ++j)
      if (reaches(i, j)) members.push_back(j);
    return members;
  }
  return {};
}

}  // namespace

ChainStatus check_transition(Eigen::MatrixXd& P, int size) {
  if (P.rows() != size || P.cols() != size || size == 0) return {What::wrong_size};
  for (int i = 0; i < size; ++i)
    if (const ChainStatus status = check_law(P.row(i), i, What::row_sum); !status) return status;
  return {};
}

ChainStatus stationary(const Eigen::MatrixXd& P, Eigen::VectorXd& law) {
  const std::vector<int> closed = closed_class(P);
  if (closed.empty()) return {What::reducible};
  law = Eigen::VectorXd::Zero(P.rows());
  // Grassmann, Taksar and Heyman: modes are taken out one by one, the probability of passing
  // through them is put on those that stay. Nothing is subtracted, so that a law of 1e-20 keeps its
  // digits.
  const int K = static_cast<int>(closed.size());
  Eigen::MatrixXd Q = P(closed, closed);
  for (int k = K - 1; k > 0; --k) {
    const double leaves = Q.row(k).head(k).sum();
    Q.col(k).head(k) /= leaves;
    for (int i = 0; i < k; ++i) Q.row(i).head(k) += Q(i, k) * Q.row(k).head(k);
  }
  Eigen::VectorXd p = Eigen::VectorXd::Zero(K);
  p(0) = 1.0;
  for (int k = 1; k < K; ++k) p(k) = p.head(k).dot(Q.col(k).head(k));
  law(closed) = p / p.sum();
  return {};
}

ConfigStatus transition_over(const Eigen::MatrixXd& rates, double dt, Eigen::MatrixXd& P) {
  const int M = static_cast<int>(rates.rows());
  if (rates.cols() != M || M == 0) return ConfigStatus::wrong_size;
  if (!std::isfinite(dt)) return ConfigStatus::not_finite;
  if (dt < 0.0) return ConfigStatus::negative;
  std::vector<double> flat;
  for (int i = 0; i < M; ++i)
    for (int j = 0; j < M; ++j) flat.push_back(rates(i, j));
  RateChain chain;
  if (const ConfigStatus status = chain.make(M, flat); status != ConfigStatus::ok) return status;
  chain.advance(dt);
  P.resize(M, M);
  for (int i = 0; i < M; ++i)
    for (int j = 0; j < M; ++j) P(i, j) = chain(i, j);
  return ConfigStatus::ok;
}

ChainStatus ModeChain::make(const std::vector<Mode>& modes, const Eigen::MatrixXd& transition,
                            const Eigen::VectorXd& initial, ModeChain& out) {
  ModeChain chain;
  for (int i = 0; i < static_cast<int>(modes.size()); ++i) {
    const Mode& mode = modes[static_cast<std::size_t>(i)];
    if (!std::isfinite(mode.gamma)) return {What::gamma, i, -1, mode.gamma};
    if (!std::isfinite(mode.delta) || !(mode.delta > 0.0)) return {What::delta, i, -1, mode.delta};
    chain.gamma.push_back(mode.gamma);
    chain.branches.push_back({{mode.delta, 1.0}});
  }
  chain.transition = transition;
  if (const auto status = check_transition(chain.transition, chain.size()); !status) return status;
  if (initial.size() == 0) {
    if (const auto status = stationary(chain.transition, chain.initial); !status) return status;
  } else {
    chain.initial = initial;
    if (initial.size() != chain.size()) return {What::wrong_size, -1, -1, 1.0};
    if (const auto status = check_law(chain.initial, -1, What::initial); !status)
      return {What::initial, status.row, status.column, status.value};
  }
  out = chain;
  return {};
}

ChainStatus ModeChain::independent(const std::vector<double>& gamma,
                                   const Eigen::MatrixXd& gamma_transition,
                                   const std::vector<double>& delta,
                                   const Eigen::MatrixXd& delta_transition, ModeChain& out) {
  Eigen::MatrixXd first = gamma_transition, second = delta_transition;
  const int I = static_cast<int>(gamma.size()), J = static_cast<int>(delta.size());
  if (const auto status = check_transition(first, I); !status) return status;
  if (const auto status = check_transition(second, J); !status) return status;
  Eigen::VectorXd first_law, second_law;
  if (const auto status = stationary(first, first_law); !status) return status;
  if (const auto status = stationary(second, second_law); !status) return status;
  std::vector<Mode> modes;
  Eigen::MatrixXd both(I * J, I * J);
  Eigen::VectorXd law(I * J);
  for (int i = 0; i < I; ++i)
    for (int j = 0; j < J; ++j) {
      modes.push_back({gamma[static_cast<std::size_t>(i)], delta[static_cast<std::size_t>(j)]});
      law(i * J + j) = first_law(i) * second_law(j);
      for (int k = 0; k < I; ++k)
        for (int l = 0; l < J; ++l) both(i * J + j, k * J + l) = first(i, k) * second(j, l);
    }
  return make(modes, both, law, out);
}

ChainStatus ModeChain::lumped(const std::vector<std::vector<int>>& groups,
                              const Eigen::VectorXd& law, ModeChain& out) const {
  const int G = static_cast<int>(groups.size());
  std::vector<int> group_of(gamma.size(), -1);
  for (int g = 0; g < G; ++g)
    for (const int i : groups[static_cast<std::size_t>(g)]) {
      if (i < 0 || i >= size() || group_of[static_cast<std::size_t>(i)] >= 0)
        return {What::lumped, i};
      group_of[static_cast<std::size_t>(i)] = g;
      if (groups[static_cast<std::size_t>(g)].size() > 1 &&
          gamma[static_cast<std::size_t>(i)] != 0.0)
        return {What::lumped, i, -1, gamma[static_cast<std::size_t>(i)]};
    }
  for (int i = 0; i < size(); ++i)
    if (group_of[static_cast<std::size_t>(i)] < 0) return {What::lumped, i};

  ModeChain chain;
  chain.transition = Eigen::MatrixXd::Zero(G, G);
  chain.initial = Eigen::VectorXd::Zero(G);
  for (int g = 0; g < G; ++g) {
    const std::vector<int>& members = groups[static_cast<std::size_t>(g)];
    if (members.empty()) return {What::lumped, -1};
    double total = 0.0;
    for (const int i : members) total += law(i);
    chain.gamma.push_back(gamma[static_cast<std::size_t>(members.front())]);
    chain.branches.emplace_back();
    for (const int i : members) {
      const double share = total > 0.0 ? law(i) / total : 1.0 / static_cast<double>(members.size());
      chain.initial(g) += initial(i);
      for (const Branch& branch : branches[static_cast<std::size_t>(i)])
        if (share * branch.share > 0.0)
          chain.branches.back().push_back({branch.delta, share * branch.share});
      for (int j = 0; j < size(); ++j)
        chain.transition(g, group_of[static_cast<std::size_t>(j)]) += share * transition(i, j);
    }
  }
  out = chain;
  return check_transition(out.transition, G);
}

}  // namespace surefix::switching
