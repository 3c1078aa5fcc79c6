// A motion model chosen at run time, for users who read a configuration.
#pragma once

#include <variant>

#include "surefix/core/discrete_model.hpp"
#include "surefix/core/integrator_chain.hpp"
#include "surefix/core/linear_model.hpp"

namespace surefix {

/// Any of the models, with F and Q as matrices of at most 8 × 8.
class AnyModel {
 public:
  static constexpr int size = Eigen::Dynamic;
  static constexpr int max_size = 8;
  static constexpr int output = -1;  // the rows of the sensors say what they read
  using Transition = DenseTransition<size, max_size>;
  using Matrix = Transition::Matrix;
  using Linear = LinearModel<size, max_size>;
  using Discrete = DiscreteModel<size, max_size>;
  using Variant = std::variant<ConstantVelocity, ConstantVelocityWithPosition, ConstantAcceleration,
                               ConstantAccelerationWithPosition, Linear, Discrete>;

  AnyModel(const Variant& model) noexcept : model_(model) {}

  [[nodiscard]] const Variant& get() const noexcept { return model_; }
  [[nodiscard]] ConfigStatus check() const noexcept;
  [[nodiscard]] int state_size() const noexcept;
  [[nodiscard]] Status transition(Time elapsed, Transition& out) const noexcept;

 private:
  Variant model_;
};

}  // namespace surefix
