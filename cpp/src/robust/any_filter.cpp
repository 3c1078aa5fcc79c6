#include "surefix/robust/any_filter.hpp"

namespace surefix::robust {
namespace {

constexpr int max_drifts = 16;

template <class To, class From>
To converted(const From& from) {
  return {typename To::Vector(from.x), typename To::Matrix(from.P)};
}

template <class Base, int Drifts>
class FilterOf final : public AnyFilter {
  using System = FaultSystem<Base, Drifts, Drifts == Eigen::Dynamic ? max_drifts : Drifts>;
  using Belief = typename Base::Belief;
  using Streaming = Filter<System, -1>;

 public:
  FilterOf(const AnySystem& any, const FilterSetup<System>& setup, const Belief& initial,
           std::optional<Time> start, std::size_t capacity)
      : any_(any),
        setup_(setup),
        initial_(initial),
        start_(start),
        filter_(setup, initial, start, capacity) {}

  Status push(Time stamp, std::int32_t sensor, double value, std::int64_t id,
              double factor) noexcept override {
    return filter_.push(stamp, sensor, value, id, factor);
  }
  Status estimate(Time time, RobustEstimate& out) noexcept override {
    return filter_.estimate(time, out);
  }
  const Counters& counters() const noexcept override { return filter_.counters(); }
  double log_likelihood() const noexcept override { return filter_.recursion().log_likelihood(); }
  std::size_t waiting() const noexcept override { return filter_.buffer().count(); }
  const Components& hypotheses() const noexcept override {
    return filter_.recursion().hypotheses();
  }
  const ModeTable& table() const noexcept override { return setup_.table; }
  const std::vector<MeasurementReport>& report() const noexcept override {
    return filter_.report();
  }

  PreparedLog prepare(const desync::LogView& log, Status* status) const override {
    PreparedLog prepared;
    prepared.sorted = desync::SortedLog(any_, log, status, largest_value);
    const bool empty = prepared.sorted.size() == 0;
    prepared.start = start_.value_or(empty ? 0 : prepared.sorted[0].valid);
    prepared.distinct = prepared.sorted.distinct_times(prepared.start);
    return prepared;
  }

  BatchSummary run(const PreparedLog& log, const desync::BatchRequest& request,
                   const BatchOutput& out) const override {
    Time start = log.start;
    if (!start_ && request.times != nullptr && request.T > 0)
      start = std::min(start, request.times[0]);  // as a stream does
    Recursion<System> recursion(setup_.system, setup_.table, setup_.prior, setup_.carry,
                                setup_.per_measurement, 64);
    Evaluation evaluation(recursion, setup_.limits);
    if (out.noise != nullptr) recursion.estimate_noise();
    recursion.start(initial_, start);
    BatchSummary summary;
    BatchRun<System> batch(recursion, evaluation, log.sorted, out);
    summary.status = batch.run(request, summary.estimates);
    summary.log_likelihood = recursion.log_likelihood();
    return summary;
  }

  SavedFilter save() const override {
    SavedFilter saved{
        filter_.recursion().state(), filter_.oldest(), filter_.started(), filter_.counters(), {}};
    for (std::size_t i = 0; i < filter_.buffer().count(); ++i)
      saved.waiting.push_back(filter_.buffer()[i]);
    return saved;
  }
  Status restore(const SavedFilter& saved) override {
    return filter_.restore(saved.state, saved.started, saved.oldest, saved.counters,
                           saved.waiting.data(), saved.waiting.size());
  }
  const AnySystem& system() const noexcept override { return any_; }

 private:
  AnySystem any_;
  FilterSetup<System> setup_;
  Belief initial_;
  std::optional<Time> start_;
  Streaming filter_;
};

/// What each sensor's outage mode says of single outliers; any other mode is refused.
ConfigStatus outlier_priors(const AnySettings& settings, PerMeasurement& out) {
  out.capacity = settings.tree;
  out.max_outliers = settings.max_faults;
  for (const SensorModes& modes : settings.modes) {
    OutlierPrior prior{0.0, -std::numeric_limits<double>::infinity()};
    for (int m = 1; m < modes.count(); ++m) {
      const FaultMode& fault = modes[m];
      if (fault.kind != FaultKind::outage || modes.count() > 2) return ConfigStatus::too_many_modes;
      prior = {std::log1p(-fault.probability), std::log(fault.probability) - std::log(fault.span)};
    }
    out.prior.push_back(prior);
  }
  return ConfigStatus::ok;
}

template <int Drifts, class Base>
std::unique_ptr<AnyFilter> make_of(const AnySystem& any, const Base& base,
                                   const AnySystem::ModelBelief& initial,
                                   const AnySettings& settings, std::optional<Time> start,
                                   std::size_t capacity, ConfigStatus& status) {
  using System = FaultSystem<Base, Drifts, Drifts == Eigen::Dynamic ? max_drifts : Drifts>;
  FilterSetup<System> setup{System(base), {}, {}, settings.carry, settings.limits, {}, true};
  const auto failed = [&](ConfigStatus result) { return (status = result) != ConfigStatus::ok; };
  if (failed(setup.system.make(settings.modes))) return nullptr;
  if (settings.tree > 0) {
    if (failed(outlier_priors(settings, setup.per_measurement))) return nullptr;
    const std::vector<SensorModes> healthy(settings.modes.size());
    if (failed(setup.table.make(healthy, 0))) return nullptr;
  } else if (failed(setup.table.make(settings.modes, settings.max_faults))) {
    return nullptr;
  }
  if (failed(settings.prior == ModePrior::Kind::joint
                 ? setup.prior.make_joint(setup.table, settings.joint_rates)
                 : setup.prior.make(settings.prior, settings.modes)))
    return nullptr;
  if (failed(setup.limits.check(base.state_size()))) return nullptr;
  if (failed(setup.carry.check())) return nullptr;
  const auto belief = base.initial(converted<typename Base::ModelBelief>(initial));
  return std::make_unique<FilterOf<Base, Drifts>>(any, setup, belief, start, capacity);
}

}  // namespace

std::unique_ptr<AnyFilter> AnyFilter::make(const AnySystem& system,
                                           const AnySystem::ModelBelief& initial,
                                           const AnySettings& settings, std::optional<Time> start,
                                           std::size_t capacity, ConfigStatus& status) {
  const auto make = [&](auto drifts, const auto& base) {
    return make_of<decltype(drifts)::value>(system, base, initial, settings, start, capacity,
                                            status);
  };
  const auto drifting = std::count_if(settings.modes.begin(), settings.modes.end(),
                                      [](const SensorModes& m) { return m.drifting() >= 0; });
  SpeedSystem speed{ConstantAcceleration(0.0)};
  const bool fast = as_speed_system(system, speed);
  // Code of fixed size is twice as fast, and slow to compile: it is made for the sizes that count.
  if (fast && drifting == 0) return make(std::integral_constant<int, 0>{}, speed);
  if (fast && drifting == 3) return make(std::integral_constant<int, 3>{}, speed);
  return make(std::integral_constant<int, Eigen::Dynamic>{}, system);
}

}  // namespace surefix::robust
