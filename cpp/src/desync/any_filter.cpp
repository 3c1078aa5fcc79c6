#include "surefix/desync/any_filter.hpp"

#include <algorithm>

#include "surefix/core/carry_over.hpp"

namespace surefix::desync {
namespace {

/// Between beliefs that differ in storage only.
template <class To, class From>
To converted(const From& from) {
  return {typename To::Vector(from.x), typename To::Matrix(from.P)};
}

struct Settings {
  AnySystem system;
  AnySystem::ModelBelief initial;
  std::optional<Time> start;
  std::size_t capacity;
};

template <class System>
class FilterOf final : public AnyFilter {
  using Belief = typename System::Belief;
  using State = RecursionState<Belief>;

 public:
  FilterOf(const Settings& settings, const System& system)
      : settings_(settings), filter_(system, initial(settings, system)) {
    if (settings.start.has_value())
      filter_ = Streaming(system, initial(settings, system), *settings.start);
    filter_.reserve(settings.capacity);
  }

  std::unique_ptr<AnyFilter> with_system(const AnySystem& system,
                                         const std::vector<int>& old_index) const override {
    const auto old = [&](int s) { return old_index[static_cast<std::size_t>(s)]; };
    SavedFilter saved = save();
    saved.belief = carry_over(settings_.system, saved.belief, system, old);
    std::vector<Measurement> kept;
    for (const Measurement& m : saved.waiting) {
      const auto found = std::find(old_index.begin(), old_index.end(), m.sensor);
      const auto s = static_cast<std::int32_t>(found - old_index.begin());
      if (found != old_index.end()) kept.push_back({m.valid, m.value, m.id, s, m.factor});
      if (found == old_index.end()) saved.counters.move(Status::ok, Status::unknown_sensor);
    }
    saved.waiting = kept;
    auto next = make(system, settings_.initial, settings_.start, settings_.capacity);
    (void)next->restore(saved);  // fits: the capacity is the same
    return next;
  }

  Status push(Time stamp, std::int32_t sensor, double value, std::int64_t id,
              double factor) noexcept override {
    return filter_.push(stamp, sensor, value, id, factor);
  }
  Status estimate(Time time, StepError& error) noexcept override {
    return filter_.estimate(time, error);
  }
  AnySystem::Belief belief() const noexcept override {
    return converted<AnySystem::Belief>(filter_.state().belief);
  }
  std::vector<NoiseEstimate> noise() const override {
    std::vector<NoiseEstimate> estimates(filter_.used());
    filter_.noise([&](std::size_t i, const NoiseEstimate& e) { estimates[i] = e; });
    return estimates;
  }
  const Counters& counters() const noexcept override { return filter_.counters(); }
  double log_likelihood() const noexcept override { return filter_.state().likelihood.value(); }
  std::size_t waiting() const noexcept override { return filter_.buffer().count(); }

  PreparedLog prepare(const LogView& log, Status* status) const override {
    PreparedLog prepared;
    prepared.sorted = SortedLog(filter_.system(), log, status);
    const bool empty = prepared.sorted.size() == 0;
    prepared.start = settings_.start.value_or(empty ? 0 : prepared.sorted[0].valid);
    prepared.distinct = prepared.sorted.distinct_times(prepared.start);
    return prepared;
  }

  BatchSummary run(const PreparedLog& log, const BatchRequest& request,
                   const BatchOutput& out) const override {
    Time start = log.start;
    if (!settings_.start && request.times != nullptr && request.T > 0)
      start = std::min(start, request.times[0]);  // as a stream does: see `Filter::estimate`
    State state = start_state(initial(settings_, filter_.system()), start);
    BatchSummary summary;
    summary.status =
        run_batch(filter_.system(), state, log.sorted, request, out, summary.estimates);
    summary.log_likelihood = state.likelihood.value();
    return summary;
  }

  SavedFilter save() const override {
    const State& state = filter_.state();
    SavedFilter saved{
        belief(),           state.time, state.oldest, filter_.started(), state.likelihood.save(),
        filter_.counters(), {}};
    for (std::size_t i = 0; i < filter_.buffer().count(); ++i)
      saved.waiting.push_back(filter_.buffer()[i]);
    return saved;
  }
  Status restore(const SavedFilter& saved) noexcept override {
    State state = start_state(converted<Belief>(saved.belief), saved.time);
    state.oldest = saved.oldest;
    state.likelihood.restore(saved.likelihood);
    return filter_.restore(state, saved.started, saved.counters, saved.waiting.data(),
                           saved.waiting.size());
  }
  const AnySystem& system() const noexcept override { return settings_.system; }

 private:
  using Streaming = Filter<System, -1>;

  static Belief initial(const Settings& settings, const System& system) {
    return system.initial(converted<typename System::ModelBelief>(settings.initial));
  }

  Settings settings_;
  Streaming filter_;
};

}  // namespace

std::unique_ptr<AnyFilter> AnyFilter::make(const AnySystem& system,
                                           const AnySystem::ModelBelief& initial,
                                           std::optional<Time> start, std::size_t capacity) {
  const Settings settings{system, initial, start, capacity};
  SpeedSystem speed{ConstantAcceleration(0.0)};
  if (as_speed_system(system, speed))
    return std::make_unique<FilterOf<SpeedSystem>>(settings, speed);
  return std::make_unique<FilterOf<AnySystem>>(settings, system);
}

}  // namespace surefix::desync
