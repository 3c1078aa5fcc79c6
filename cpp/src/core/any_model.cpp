#include "surefix/core/any_model.hpp"

namespace surefix {
namespace {

/// A chain's F and Q as matrices, from what its transition does to the unit vectors.
template <int N, int Output>
Status dense(const IntegratorChain<N, Output>& chain, Time elapsed, AnyModel::Transition& out) {
  ChainTransition<N> transition;
  const Status status = chain.transition(elapsed, transition);
  out.F = AnyModel::Matrix::Identity(N, N);
  out.Q = AnyModel::Matrix::Zero(N, N);
  for (int j = 0; j < N; ++j) transition.apply(out.F.col(j));
  transition.add_noise(out.Q);
  return out.F.allFinite() && out.Q.allFinite() ? status : Status::numerical;
}

Status dense(const AnyModel::Linear& model, Time elapsed, AnyModel::Transition& out) {
  return model.transition(elapsed, out);
}

Status dense(const AnyModel::Discrete& model, Time elapsed, AnyModel::Transition& out) {
  return model.transition(elapsed, out);
}

}  // namespace

ConfigStatus AnyModel::check() const noexcept {
  return std::visit([](const auto& model) { return model.check(); }, model_);
}

int AnyModel::state_size() const noexcept {
  return std::visit([](const auto& model) { return model.state_size(); }, model_);
}

Status AnyModel::transition(Time elapsed, Transition& out) const noexcept {
  return std::visit([&](const auto& model) { return dense(model, elapsed, out); }, model_);
}

}  // namespace surefix
