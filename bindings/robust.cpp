#include <pybind11/stl.h>

#include "arrays.hpp"
#include "surefix/robust/alert_limits.hpp"
#include "surefix/robust/any_filter.hpp"
#include "waiting.hpp"

namespace surefix::bindings {
namespace {

using namespace surefix::robust;

/// (kind, span, factor, resolution, change, sigma, walk, probability, rate, duration).
using ModeTuple =
    std::tuple<int, double, double, double, double, double, double, double, double, double>;

[[noreturn]] void refuse(ConfigStatus status) { throw std::invalid_argument(name(status)); }

std::vector<SensorModes> sensor_modes(const std::vector<std::vector<ModeTuple>>& sensors) {
  std::vector<SensorModes> out;
  for (const auto& modes : sensors) {
    SensorModes sensor;
    for (const auto& [kind, span, factor, resolution, change, sigma, walk, probability, rate,
                      duration] : modes) {
      const ConfigStatus status =
          sensor.add({static_cast<FaultKind>(kind), span, factor, resolution, change, sigma, walk,
                      probability, rate, duration});
      if (status != ConfigStatus::ok) refuse(status);
    }
    out.push_back(sensor);
  }
  return out;
}

std::unique_ptr<AnyFilter> make_filter(const AnySystem& system, const Array& x, const Array& P,
                                       const std::vector<std::vector<ModeTuple>>& modes,
                                       int max_faults, int prior,
                                       const std::vector<double>& joint_rates, int carry,
                                       int components, double cut, double memory,
                                       const std::vector<double>& direction, double risk, int sides,
                                       std::size_t tree, std::optional<Time> start,
                                       std::size_t capacity) {
  const AnySettings settings{sensor_modes(modes),
                             max_faults,
                             static_cast<ModePrior::Kind>(prior),
                             joint_rates,
                             {static_cast<Carry::Kind>(carry), components, cut, memory},
                             {direction, risk, static_cast<Sides>(sides)},
                             tree};
  ConfigStatus status = ConfigStatus::ok;
  auto filter = AnyFilter::make(system, {vector(x), matrix(P)}, settings, start, capacity, status);
  if (!filter) refuse(status);
  return filter;
}

/// The modes of every sensor (T, S) under the hypotheses (T).
py::array_t<std::int8_t> modes_of(const ModeTable& table, const std::vector<std::int32_t>& h) {
  py::array_t<std::int8_t> out(
      {static_cast<py::ssize_t>(h.size()), static_cast<py::ssize_t>(table.sensors())});
  for (std::size_t t = 0; t < h.size(); ++t)
    for (int s = 0; s < table.sensors(); ++s)
      out.mutable_at(static_cast<py::ssize_t>(t), s) =
          static_cast<std::int8_t>(table.mode(h[t], s));
  return out;
}

/// One call per log; the GIL is released while it runs.
py::dict run(const AnyFilter& filter, const py::array_t<Time, py::array::c_style>& stamp,
             const py::array_t<std::int32_t, py::array::c_style>& sensor,
             const py::array_t<double, py::array::c_style>& value,
             const std::optional<Array>& factor,
             const std::optional<py::array_t<Time, py::array::c_style>>& times,
             std::optional<Time> delay, bool per_measurement, bool with_noise) {
  const py::ssize_t N = stamp.shape(0);
  if (sensor.shape(0) != N || value.shape(0) != N)
    throw std::invalid_argument("stamp, sensor, value: expected one length");
  const desync::LogView log{stamp.data(), sensor.data(), value.data(), static_cast<std::size_t>(N),
                            factors(factor, N)};
  py::array_t<std::uint8_t> status(N);
  py::array_t<std::int64_t> estimate(N);
  auto* status_data = reinterpret_cast<Status*>(status.mutable_data());
  py::array_t<double> outlier(per_measurement ? N : 0);
  py::array_t<double> noise(with_noise ? N : 0), variance(with_noise ? N : 0);
  std::fill_n(estimate.mutable_data(), N, -1);
  for (auto* rows : {&outlier, &noise, &variance})
    std::fill_n(rows->mutable_data(), rows->size(), std::numeric_limits<double>::quiet_NaN());
  const PreparedLog prepared = filter.prepare(log, status_data);

  const py::ssize_t T = times ? times->shape(0) : static_cast<py::ssize_t>(prepared.distinct);
  const py::ssize_t n = filter.system().state_size(), S = filter.system().sensor_count();
  const py::ssize_t M = SensorModes::max_modes;
  py::array_t<double> time(T), x({T, n}), P({T, n, n}), lower(T), upper(T), modes({T, S, M});
  py::array_t<double> discarded(T), sse(T);
  py::array_t<std::int32_t> degrees(T);
  std::vector<std::int32_t> hypothesis(static_cast<std::size_t>(T), 0);
  const BatchOutput out{time.mutable_data(),
                        x.mutable_data(),
                        P.mutable_data(),
                        lower.mutable_data(),
                        upper.mutable_data(),
                        modes.mutable_data(),
                        hypothesis.data(),
                        discarded.mutable_data(),
                        sse.mutable_data(),
                        degrees.mutable_data(),
                        status_data,
                        estimate.mutable_data(),
                        per_measurement ? outlier.mutable_data() : nullptr,
                        with_noise ? noise.mutable_data() : nullptr,
                        with_noise ? variance.mutable_data() : nullptr};
  const Time* wanted = times ? times->data() : nullptr;
  BatchSummary summary;
  {
    py::gil_scoped_release release;
    const desync::BatchRequest request{wanted, static_cast<std::size_t>(T),
                                       desync::NoiseScope::none, delay.value_or(desync::any_delay)};
    summary = filter.run(prepared, request, out);
  }
  py::dict result;
  result["time"] = time;
  result["x"] = x;
  result["P"] = P;
  result["lower"] = lower;
  result["upper"] = upper;
  result["mode_probability"] = modes;
  result["hypothesis"] = modes_of(filter.table(), hypothesis);
  result["discarded_mass"] = discarded;
  result["sse"] = sse;
  result["degrees_of_freedom"] = degrees;
  result["status"] = status;
  result["step"] = estimate;
  result["outlier_probability"] = outlier;
  result["noise"] = noise;
  result["noise_variance"] = variance;
  result["log_likelihood"] = summary.log_likelihood;
  result["ended"] = name(summary.status);
  result["estimates"] = summary.estimates;
  return result;
}

py::dict estimate(AnyFilter& filter, Time time) {
  RobustEstimate e;
  const Status status = filter.estimate(time, e);
  py::dict out;
  out["status"] = name(status);
  if (status != Status::ok) return out;
  const py::ssize_t n = filter.system().state_size(), S = filter.system().sensor_count();
  out["x"] = py::array_t<double>(n, e.x);
  out["P"] = py::array_t<double>({n, n}, e.P);
  out["lower"] = e.lower;
  out["upper"] = e.upper;
  out["mode_probability"] =
      py::array_t<double>({S, py::ssize_t{SensorModes::max_modes}}, e.mode_probability);
  out["hypothesis"] = modes_of(filter.table(), {e.hypothesis});
  out["discarded_mass"] = e.discarded;
  out["sse"] = e.sse;
  out["degrees_of_freedom"] = e.degrees;
  const std::vector<MeasurementReport>& report = filter.report();
  const auto k = static_cast<py::ssize_t>(report.size());
  py::array_t<std::int64_t> id(k);
  py::array_t<std::int32_t> sensor(k);
  py::array_t<double> outlier(k), noise(k), variance(k);
  for (py::ssize_t i = 0; i < k; ++i) {
    const MeasurementReport& row = report[static_cast<std::size_t>(i)];
    id.mutable_at(i) = row.id;
    sensor.mutable_at(i) = row.sensor;
    outlier.mutable_at(i) = row.outlier;
    noise.mutable_at(i) = row.noise;
    variance.mutable_at(i) = row.noise_variance;
  }
  out["noise_id"] = id;
  out["sensor"] = sensor;
  out["outlier_probability"] = outlier;
  out["noise"] = noise;
  out["noise_variance"] = variance;
  return out;
}

/// Weights (C), modes (C, S), x (C, m), P (C, m, m) of a mixture over all m states.
py::dict mixture(const Components& c, const ModeTable& table) {
  const auto C = static_cast<py::ssize_t>(c.count()), m = py::ssize_t{c.state_size()};
  py::array_t<double> log_weight(C), x({C, m}), P({C, m, m});
  std::vector<std::int32_t> hypothesis;
  for (std::size_t i = 0; i < c.count(); ++i) {
    const auto row = static_cast<py::ssize_t>(i);
    log_weight.mutable_at(row) = c.log_weight(i);
    hypothesis.push_back(c.hypothesis(i));
    std::copy(c.x(i), c.x(i) + m, x.mutable_data(row, 0));
    std::copy(c.P(i), c.P(i) + m * m, P.mutable_data(row, 0, 0));
  }
  py::dict out;
  out["log_weight"] = log_weight;
  out["hypothesis"] = py::cast(hypothesis);
  out["modes"] = modes_of(table, hypothesis);
  out["x"] = x;
  out["P"] = P;
  return out;
}

py::dict save(const AnyFilter& filter) {
  const SavedFilter saved = filter.save();
  const MixtureState& state = saved.state;
  std::vector<bool> known;
  std::vector<double> last;
  for (const LastValue& l : state.last) {
    known.push_back(l.known);
    last.push_back(l.value);
  }
  py::dict out;
  out["components"] = mixture(state.components, filter.table());
  out["mode"] = state.mode;
  out["last"] = py::make_tuple(known, last);
  out["time"] = state.time;
  out["first"] = state.first;
  out["mass"] = py::make_tuple(state.discarded, state.cut_last, state.log_likelihood);
  out["oldest"] = saved.oldest;
  out["started"] = saved.started;
  out["counters"] = py::tuple(py::cast(saved.counters.all()));
  out["waiting"] = pack(saved.waiting);
  return out;
}

void read_mixture(const py::dict& in, const ModeTable& table, Components& c) {
  const auto log_weight = in["log_weight"].cast<Array>();
  const auto x = in["x"].cast<Array>(), P = in["P"].cast<Array>();
  const auto hypothesis = in["hypothesis"].cast<std::vector<int>>();
  const auto C = hypothesis.size();
  const py::ssize_t m = c.state_size();
  const bool fits = C >= 1 && C <= c.capacity() &&
                    log_weight.size() == static_cast<py::ssize_t>(C) &&
                    x.size() == static_cast<py::ssize_t>(C) * m && P.size() == x.size() * m;
  if (!fits) throw std::invalid_argument("components: size does not fit");
  c.resize(C);
  for (std::size_t i = 0; i < C; ++i) {
    const auto row = static_cast<py::ssize_t>(i);
    if (hypothesis[i] < 0 || hypothesis[i] >= table.count())
      throw std::invalid_argument("components: no such hypothesis");
    c.log_weight(i) = log_weight.data()[row];
    c.hypothesis(i) = hypothesis[i];
    std::copy(x.data() + row * m, x.data() + (row + 1) * m, c.x(i));
    std::copy(P.data() + row * m * m, P.data() + (row + 1) * m * m, c.P(i));
  }
}

const char* restore(AnyFilter& filter, const py::dict& in) {
  SavedFilter saved = filter.save();
  MixtureState& state = saved.state;
  read_mixture(in["components"], filter.table(), state.components);
  const auto mode = in["mode"].cast<std::vector<double>>();
  const auto last = in["last"].cast<std::tuple<std::vector<bool>, std::vector<double>>>();
  if (mode.size() != state.mode.size() || std::get<0>(last).size() != state.last.size() ||
      std::get<1>(last).size() != state.last.size())
    throw std::invalid_argument("mode, last: size does not fit");
  state.mode = mode;
  for (std::size_t s = 0; s < state.last.size(); ++s)
    state.last[s] = {std::get<1>(last)[s], std::get<0>(last)[s]};
  state.time = in["time"].cast<Time>();
  state.first = in["first"].cast<bool>();
  std::tie(state.discarded, state.cut_last, state.log_likelihood) =
      in["mass"].cast<std::tuple<double, double, double>>();
  saved.oldest = in["oldest"].cast<Time>();
  saved.started = in["started"].cast<bool>();
  saved.counters.restore(in["counters"].cast<std::array<std::int64_t, status_count>>());
  saved.waiting = unpack(in["waiting"]);
  return name(filter.restore(saved));
}

/// (lower, upper) of a mixture at `risk`, half of it on each side, or all of it on one.
py::tuple alert_limits(const Array& weight, const Array& mean, const Array& sigma, double risk,
                       int sides) {
  if (weight.ndim() != 1 || mean.size() != weight.size() || sigma.size() != weight.size())
    throw std::invalid_argument("weights, means, sigmas: expected one length");
  const TailMixture tails{weight.data(), mean.data(), sigma.data(),
                          static_cast<std::size_t>(weight.size())};
  const AlertLimits limits = find_limits(tails, risk, static_cast<Sides>(sides));
  return py::make_tuple(limits.lower, limits.upper);
}

}  // namespace

void bind_robust(py::module_& module) {
  module.attr("MAX_MODES") = static_cast<int>(SensorModes::max_modes);
  module.attr("MAX_HYPOTHESES") = static_cast<int>(ModeTable::max_hypotheses);
  module.attr("MAX_MEASUREMENTS") = static_cast<int>(PerMeasurement::max_measurements);
  module.attr("LARGEST_VALUE") = largest_value;
  module.def("alert_limits", &alert_limits, py::arg("weight"), py::arg("mean"), py::arg("sigma"),
             py::arg("risk"), py::arg("sides"));
  module.def("per_estimate", &per_estimate, py::arg("risk"), py::arg("exposures"));

  py::class_<AnyFilter>(module, "RobustEngine")
      .def(py::init(&make_filter), py::arg("system"), py::arg("x"), py::arg("P"), py::arg("modes"),
           py::arg("max_faults"), py::arg("prior"), py::arg("joint_rates"), py::arg("carry"),
           py::arg("components"), py::arg("cut"), py::arg("memory"), py::arg("direction"),
           py::arg("risk"), py::arg("sides"), py::arg("tree"), py::arg("start"),
           py::arg("capacity"))
      .def(
          "push",
          [](AnyFilter& filter, Time stamp, std::int32_t sensor, double value, std::int64_t id,
             double factor) {
            return static_cast<int>(filter.push(stamp, sensor, value, id, factor));
          },
          py::arg("stamp"), py::arg("sensor"), py::arg("value"), py::arg("id"), py::arg("factor"))
      .def("estimate", &estimate, py::arg("time"))
      .def_property_readonly(
          "counters",
          [](const AnyFilter& filter) { return py::tuple(py::cast(filter.counters().all())); })
      .def_property_readonly("log_likelihood", &AnyFilter::log_likelihood)
      .def_property_readonly("waiting", &AnyFilter::waiting)
      .def("hypotheses",
           [](const AnyFilter& filter) { return mixture(filter.hypotheses(), filter.table()); })
      .def("run", &run, py::arg("stamp").noconvert(), py::arg("sensor").noconvert(),
           py::arg("value").noconvert(), py::arg("factor"), py::arg("times"), py::arg("delay"),
           py::arg("per_measurement"), py::arg("noise"))
      .def("save", &save)
      .def("restore", &restore, py::arg("saved"));
}

}  // namespace surefix::bindings
