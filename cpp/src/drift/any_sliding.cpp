#include "surefix/drift/any_sliding.hpp"

namespace surefix::drift {
namespace {

template <class System>
class SlidingOf final : public AnySliding {
  using Belief = typename System::Belief;
  using Filter = desync::Filter<System, -1>;

 public:
  SlidingOf(const System& system, const Belief& belief, std::optional<Time> start,
            std::size_t capacity, std::size_t window)
      : filter_(start ? Filter(system, belief, *start) : Filter(system, belief)),
        detector_(system, window) {
    filter_.reserve(capacity);
  }

  ConfigStatus add(const Profile& profile, const Direction& direction,
                   double false_alarm) noexcept override {
    return detector_.add(profile, direction, false_alarm);
  }
  Status push(Time stamp, std::int32_t sensor, double value, std::int64_t id,
              double factor) noexcept override {
    return filter_.push(stamp, sensor, value, id, factor);
  }
  Status estimate(Time time, desync::StepError& error) noexcept override {
    const Status status = filter_.estimate(time, error);
    if (status == Status::ok) detector_.take(filter_);
    return status;
  }
  AnySystem::Belief belief() const noexcept override {
    const Belief& own = filter_.state().belief;
    return {AnySystem::Belief::Vector(own.x), AnySystem::Belief::Matrix(own.P)};
  }
  SlidingFinding look(int search) const noexcept override { return detector_.look(search); }
  std::size_t size() const noexcept override { return detector_.record().size(); }
  void clear() noexcept override { detector_.clear(); }

 private:
  Filter filter_;
  SlidingDetector<System, -1, max_searches> detector_;
};

}  // namespace

std::unique_ptr<AnySliding> AnySliding::make(const AnySystem& system,
                                             const AnySystem::ModelBelief& initial,
                                             std::optional<Time> start, std::size_t capacity,
                                             std::size_t window) {
  SpeedSystem speed{ConstantAcceleration(0.0)};
  if (as_speed_system(system, speed)) {
    const SpeedSystem::ModelBelief belief{SpeedSystem::ModelBelief::Vector(initial.x),
                                          SpeedSystem::ModelBelief::Matrix(initial.P)};
    return std::make_unique<SlidingOf<SpeedSystem>>(speed, speed.initial(belief), start, capacity,
                                                    window);
  }
  return std::make_unique<SlidingOf<AnySystem>>(system, system.initial(initial), start, capacity,
                                                window);
}

}  // namespace surefix::drift
