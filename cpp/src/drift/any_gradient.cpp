#include "surefix/drift/any_gradient.hpp"

#include "surefix/core/large_array.hpp"
#include "surefix/drift/gradient.hpp"

namespace surefix::drift {
namespace {

template <class S>
class GradientOf final : public AnyGradient {
 public:
  static ConfigStatus make(const LinearSystem& system, std::unique_ptr<AnyGradient>& out) {
    auto made = std::make_unique<GradientOf>();
    made->steps_ = system.steps();
    const ConfigStatus status = made->system_.make(system);
    if (status != ConfigStatus::ok) return status;
    if constexpr (S::m == 1) {
      made->first_state_ = true;
      for (const Eigen::MatrixXd& H : system.H)
        made->first_state_ &= H == Eigen::MatrixXd::Identity(1, H.cols());
    }
    out = std::move(made);
    return status;
  }
  Status run(const double* z, int T, const double* inputs, double* out) const override {
    const auto count = static_cast<std::size_t>(T) * static_cast<std::size_t>(measured());
    LargeArray<double> kept(count * static_cast<std::size_t>(kept_of_each(size())));
    if (first_state_)
      return likelihood_gradient<FirstState>(system_, z, T, inputs, kept.data(), out);
    return likelihood_gradient<AnyRows>(system_, z, T, inputs, kept.data(), out);
  }
  int size() const noexcept override { return system_.size(); }
  int measured() const noexcept override { return system_.measured(); }
  int steps() const noexcept override { return steps_; }

 private:
  PreparedSystem<S> system_;
  int steps_ = 0;
  bool first_state_ = false;
};

}  // namespace

ConfigStatus AnyGradient::make(const LinearSystem& system, std::unique_ptr<AnyGradient>& out) {
  if (system.size() == 2 && system.measured() == 1)
    return GradientOf<LinearSizes<2, 1>>::make(system, out);
  return GradientOf<AnyLinearSizes>::make(system, out);
}

}  // namespace surefix::drift
