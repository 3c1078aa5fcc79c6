#include "surefix/drift/any_record.hpp"

#include "record_of.hpp"

namespace surefix::drift {
namespace {

/// The record of a linear system whose sizes are S.
template <class S>
std::unique_ptr<AnyRecord> of_system(const LinearSystem& system, const SystemData& data,
                                     Status& status) {
  PreparedSystem<S> prepared;
  if (prepared.make(system) != ConfigStatus::ok) {
    status = Status::numerical;
    return nullptr;
  }
  const int m = system.measured();
  auto out = std::make_unique<RecordOf<S::n, S::max_n>>(
      system.size(), m, static_cast<std::size_t>(data.T) * static_cast<std::size_t>(m));
  auto& record = out->record;
  status = GainPass(prepared, data, record).run();
  if (status != Status::ok) return nullptr;

  const std::size_t count = record.size();
  const auto runs = static_cast<std::size_t>(data.runs);
  out->innovations = LargeArray<double>(runs * count);
  over_runs({nullptr, 0, data.runs}, [&](std::int64_t run, int lanes, auto kind) {
    pass_means<decltype(kind)>(prepared, data, record, run, lanes, out->innovations.data());
  });
  LogLikelihood variances;
  for (std::size_t i = 0; i < count; ++i) variances.add_variance(1.0 / record[i].inverse);
  for (std::size_t run = 0; run < runs; ++run) {
    double squares = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const double nu = out->innovations[run * count + i];
      squares += nu * (nu * record[i].inverse);
    }
    if (!finite(squares)) {
      status = Status::numerical;
      return nullptr;
    }
    LogLikelihood likelihood = variances;
    likelihood.add_squares(squares, static_cast<std::int64_t>(count));
    out->log_likelihood.push_back(likelihood.value());
  }
  return out;
}

template <class Record, class System>
std::unique_ptr<AnyRecord> of_log(const System& system, const typename System::Belief& belief,
                                  std::optional<Time> start, const desync::LogView& log,
                                  Status* status) {
  const desync::SortedLog sorted(system, log, status);
  auto out = std::make_unique<Record>(system.state_size(), system.sensor_count(), sorted.size());
  out->innovations = LargeArray<double>(sorted.size());
  out->log_likelihood.resize(1);
  pass_log(system, belief, start, sorted, status, out->record, out->innovations,
           out->log_likelihood.front());
  return out;
}

}  // namespace

std::unique_ptr<AnyRecord> AnyRecord::of(const LinearSystem& system, const SystemData& data,
                                         Status& status) {
  if (system.size() == 2 && system.measured() == 1)
    return of_system<LinearSizes<2, 1>>(system, data, status);
  return of_system<AnyLinearSizes>(system, data, status);
}

std::unique_ptr<AnyRecord> AnyRecord::of(const AnySystem& system,
                                         const AnySystem::ModelBelief& initial,
                                         std::optional<Time> start, const desync::LogView& log,
                                         Status* status) {
  SpeedSystem speed{ConstantAcceleration(0.0)};
  if (as_speed_system(system, speed)) {
    const SpeedSystem::ModelBelief belief{SpeedSystem::ModelBelief::Vector(initial.x),
                                          SpeedSystem::ModelBelief::Matrix(initial.P)};
    return of_log<RecordOf<2, 2>>(speed, speed.initial(belief), start, log, status);
  }
  return of_log<RecordOf<Eigen::Dynamic, AnySystem::max_size>>(system, system.initial(initial),
                                                               start, log, status);
}

}  // namespace surefix::drift
