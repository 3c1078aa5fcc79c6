#include <pybind11/stl.h>

#include <limits>

#include "arrays.hpp"
#include "surefix/desync/any_filter.hpp"
#include "surefix/desync/composite_step.hpp"
#include "waiting.hpp"

namespace surefix::bindings {
namespace {

using namespace surefix::desync;

AnySystem::ModelBelief model_belief(const Array& x, const Array& P) {
  return {vector(x), matrix(P)};
}

py::tuple counts(const Counters& counters) { return py::tuple(py::cast(counters.all())); }

/// One call per log, arrays as long as the estimates that were made: (time, x, P, sse, degrees,
/// status, noise, noise_variance, log-likelihood, name of the status that ended it, number of
/// estimates). The GIL is released while it runs.
py::tuple run(const AnyFilter& filter, const py::array_t<Time, py::array::c_style>& stamp,
              const py::array_t<std::int32_t, py::array::c_style>& sensor,
              const py::array_t<double, py::array::c_style>& value,
              const std::optional<Array>& factor,
              const std::optional<py::array_t<Time, py::array::c_style>>& times, int noise_scope,
              std::optional<Time> delay) {
  const py::ssize_t N = stamp.shape(0);
  if (sensor.shape(0) != N || value.shape(0) != N)
    throw std::invalid_argument("stamp, sensor, value: expected one length");
  const LogView log{stamp.data(), sensor.data(), value.data(), static_cast<std::size_t>(N),
                    factors(factor, N)};
  const auto scope = static_cast<NoiseScope>(noise_scope);
  const bool noisy = scope != NoiseScope::none;

  py::array_t<std::uint8_t> status(N);
  auto* status_data = reinterpret_cast<Status*>(status.mutable_data());
  PreparedLog prepared;
  {
    py::gil_scoped_release release;
    prepared = filter.prepare(log, status_data);
  }
  const py::ssize_t T = times ? times->shape(0) : static_cast<py::ssize_t>(prepared.distinct);
  const py::ssize_t n = filter.system().state_size();
  const py::ssize_t noises = noisy ? N : 0;
  Block block(8 * (T * (3 + n + n * n) + 2 * noises));
  auto time = block.take<double>({T}), x = block.take<double>({T, n});
  auto P = block.take<double>({T, n, n}), sse = block.take<double>({T});
  auto v = block.take<double>({noises}), variance = block.take<double>({noises});
  auto degrees = block.take<std::int32_t>({T});
  const BatchOutput out{time.mutable_data(),
                        x.mutable_data(),
                        P.mutable_data(),
                        sse.mutable_data(),
                        degrees.mutable_data(),
                        status_data,
                        noisy ? v.mutable_data() : nullptr,
                        noisy ? variance.mutable_data() : nullptr};
  const Time* wanted = times ? times->data() : nullptr;
  BatchSummary summary;
  {
    py::gil_scoped_release release;
    const BatchRequest request{wanted, static_cast<std::size_t>(T), scope,
                               delay.value_or(any_delay)};
    summary = filter.run(prepared, request, out);
    for (py::ssize_t i = 0; i < noises; ++i)
      if (status_data[i] != Status::ok)
        out.noise[i] = out.noise_variance[i] = std::numeric_limits<double>::quiet_NaN();
  }
  const py::slice made(0, static_cast<py::ssize_t>(summary.estimates), 1);
  return py::make_tuple(time[made], x[made], P[made], sse[made], degrees[made], status, v, variance,
                        summary.log_likelihood, name(summary.status), summary.estimates);
}

py::dict save(const AnyFilter& filter) {
  const SavedFilter saved = filter.save();
  py::dict out;
  out["x"] = to_numpy(saved.belief.x);
  out["P"] = to_numpy(saved.belief.P);
  out["time"] = saved.time;
  out["oldest"] = saved.oldest;
  out["started"] = saved.started;
  out["likelihood"] = py::make_tuple(saved.likelihood.product, saved.likelihood.exponent,
                                     saved.likelihood.squares, saved.likelihood.count);
  out["counters"] = counts(saved.counters);
  out["waiting"] = pack(saved.waiting);
  return out;
}

const char* restore(AnyFilter& filter, const py::dict& in) {
  SavedFilter saved{};
  saved.belief = {vector(in["x"].cast<Array>()), matrix(in["P"].cast<Array>())};
  const auto n = filter.system().state_size();
  if (saved.belief.x.size() != n || saved.belief.P.rows() != n || saved.belief.P.cols() != n)
    throw std::invalid_argument("saved state: size does not fit");
  saved.time = in["time"].cast<Time>();
  saved.oldest = in["oldest"].cast<Time>();
  saved.started = in["started"].cast<bool>();
  const auto likelihood =
      in["likelihood"].cast<std::tuple<double, std::int64_t, double, std::int64_t>>();
  saved.likelihood = {std::get<0>(likelihood), std::get<1>(likelihood), std::get<2>(likelihood),
                      std::get<3>(likelihood)};
  saved.counters.restore(in["counters"].cast<std::array<std::int64_t, status_count>>());
  saved.waiting = unpack(in["waiting"]);
  return name(filter.restore(saved));
}

std::unique_ptr<CompositeStep> make_step(const std::vector<Array>& F, const std::vector<Array>& Q,
                                         const std::vector<Array>& G, const std::vector<Array>& H,
                                         const std::vector<Array>& R, const std::vector<Array>& J,
                                         const std::optional<Array>& Upsilon) {
  std::vector<Leg> legs;
  for (std::size_t i = 0; i < F.size(); ++i)
    legs.push_back({matrix(F[i]), matrix(Q.at(i)), matrix(G.at(i))});
  std::vector<Observation> observations;
  for (std::size_t i = 0; i < H.size(); ++i)
    observations.push_back({matrix(H[i]), matrix(R.at(i)), matrix(J.at(i))});
  if (!Upsilon) return std::make_unique<CompositeStep>(legs, observations);
  return std::make_unique<CompositeStep>(legs, observations, matrix(*Upsilon));
}

py::dict update(const CompositeStep& step, const Array& x, const Array& P, const Array& z,
                const Array& u, bool sequential) {
  StepUpdate out;
  const Status status = sequential
                            ? step.sequential(vector(x), matrix(P), vector(z), vector(u), out)
                            : step.composite(vector(x), matrix(P), vector(z), vector(u), out);
  py::dict result;
  result["status"] = name(status);
  if (status != Status::ok) return result;
  result["x"] = to_numpy(out.x);
  result["P"] = to_numpy(out.P);
  result["innovation"] = to_numpy(out.innovation);
  result["noise"] = to_numpy(out.noise);
  result["noise_variance"] = to_numpy(out.noise_variance);
  result["sse"] = out.sse;
  result["log_likelihood"] = out.log_likelihood;
  return result;
}

}  // namespace

void bind_desync(py::module_& module) {
  module.attr("SIGMA_FACTORS") = py::make_tuple(smallest_factor, largest_factor);
  py::class_<AnyFilter>(module, "FilterEngine")
      .def(py::init([](const AnySystem& system, const Array& x, const Array& P,
                       std::optional<Time> start, std::size_t capacity) {
             return AnyFilter::make(system, model_belief(x, P), start, capacity);
           }),
           py::arg("system"), py::arg("x"), py::arg("P"), py::arg("start"), py::arg("capacity"))
      .def("with_system", &AnyFilter::with_system, py::arg("system"), py::arg("old_index"))
      .def(
          "push",
          [](AnyFilter& filter, Time stamp, std::int32_t sensor, double value, std::int64_t id,
             double factor) {
            return static_cast<int>(filter.push(stamp, sensor, value, id, factor));
          },
          py::arg("stamp"), py::arg("sensor"), py::arg("value"), py::arg("id"), py::arg("factor"))
      .def(
          "estimate",
          [](AnyFilter& filter, Time time) {
            StepError error;
            const Status status = filter.estimate(time, error);
            const auto belief = filter.belief();
            return py::make_tuple(name(status), to_numpy(belief.x), to_numpy(belief.P), error.sse,
                                  error.degrees);
          },
          py::arg("time"))
      .def("noise",
           [](const AnyFilter& filter) {
             const auto estimates = filter.noise();
             const auto count = static_cast<py::ssize_t>(estimates.size());
             py::array_t<std::int64_t> id(count);
             py::array_t<double> value(count), variance(count);
             for (py::ssize_t i = 0; i < count; ++i) {
               const NoiseEstimate& e = estimates[static_cast<std::size_t>(i)];
               id.mutable_at(i) = e.id;
               value.mutable_at(i) = e.value;
               variance.mutable_at(i) = e.variance;
             }
             return py::make_tuple(id, value, variance);
           })
      .def_property_readonly("counters",
                             [](const AnyFilter& filter) { return counts(filter.counters()); })
      .def_property_readonly("log_likelihood", &AnyFilter::log_likelihood)
      .def_property_readonly("waiting", &AnyFilter::waiting)
      .def("run", &run, py::arg("stamp").noconvert(), py::arg("sensor").noconvert(),
           py::arg("value").noconvert(), py::arg("factor"), py::arg("times"),
           py::arg("noise_scope"), py::arg("delay"))
      .def("save", &save)
      .def("restore", &restore, py::arg("saved"));

  py::class_<CompositeStep>(module, "CompositeEngine")
      .def(py::init(&make_step), py::arg("F"), py::arg("Q"), py::arg("G"), py::arg("H"),
           py::arg("R"), py::arg("J"), py::arg("Upsilon"))
      .def_property_readonly("separable", &CompositeStep::separable)
      .def("matrices",
           [](const CompositeStep& step) {
             const CompositeMatrices& m = step.matrices();
             py::dict out;
             out["F"] = to_numpy(m.F);
             out["G"] = to_numpy(m.G);
             out["W"] = to_numpy(m.W);
             out["Omega"] = to_numpy(m.Omega);
             out["Upsilon"] = to_numpy(m.Upsilon);
             out["J"] = to_numpy(m.J);
             out["HF"] = to_numpy(m.HF);
             out["L"] = to_numpy(m.L);
             return out;
           })
      .def("backward",
           [](const CompositeStep& step) -> py::object {
             BackwardMatrices m;
             if (!step.backward(m)) return py::none();
             py::dict out;
             out["H"] = to_numpy(m.H);
             out["Theta"] = to_numpy(m.Theta);
             out["Xi"] = to_numpy(m.Xi);
             out["Jtilde"] = to_numpy(m.Jtilde);
             return out;
           })
      .def(
          "Gamma",
          [](const CompositeStep& step, const Array& P) { return to_numpy(step.Gamma(matrix(P))); },
          py::arg("P"))
      .def("update", &update, py::arg("x"), py::arg("P"), py::arg("z"), py::arg("u"),
           py::arg("sequential"));
}

}  // namespace surefix::bindings
