#include <pybind11/stl.h>

#include <limits>

#include "arrays.hpp"
#include "surefix/drift/any_gradient.hpp"
#include "surefix/drift/any_record.hpp"
#include "surefix/drift/any_sliding.hpp"
#include "surefix/drift/likelihood_ratio.hpp"
#include "threads.hpp"

namespace surefix::bindings {
namespace {

using namespace surefix::drift;
using Direction = std::vector<double>;

Profile make_profile(const Array& A, const Array& output, const Array& onset) {
  if (A.shape(0) > Profile::max_size) throw std::invalid_argument("profile: too many states");
  Profile profile;
  const ConfigStatus status = Profile::make(matrix(A), vector(output), matrix(onset), profile);
  if (status != ConfigStatus::ok) throw std::invalid_argument(name(status));
  return profile;
}

/// s (elapsed, p, q) of unit amplitudes.
Array states(const Profile& profile, const Array& elapsed) {
  const py::ssize_t p = profile.size(), q = profile.amplitudes();
  Array out({elapsed.shape(0), p, q});
  for (py::ssize_t k = 0; k < elapsed.shape(0); ++k) {
    Profile::Matrix F;
    const bool good = profile.transition(elapsed.at(k), F);
    const Profile::Matrix s = F * profile.onset();
    for (py::ssize_t i = 0; i < p; ++i)
      for (py::ssize_t a = 0; a < q; ++a)
        out.mutable_at(k, i, a) = good ? s(i, a) : std::numeric_limits<double>::quiet_NaN();
  }
  return out;
}

/// The record, with x (runs, steps, n) and P (steps, n, n) if wanted; or the name of the status
/// that says why there is none.
py::object of_system(const LinearSystem& system, const Array& z, const std::optional<Array>& inputs,
                     const Array& times, bool estimates) {
  const int T = static_cast<int>(z.shape(1));
  if (z.ndim() != 3 || z.shape(2) != system.measured() || times.shape(0) != T)
    throw std::invalid_argument("z, times: expected (runs, steps, m), (steps)");
  if (inputs && (inputs->shape(0) != T - 1 || inputs->shape(1) != system.size()))
    throw std::invalid_argument("inputs: expected (steps - 1, n)");
  const py::ssize_t n = system.size(), kept = estimates ? T : 0;
  Array x({z.shape(0), kept, n}), P({kept, n, n});
  const SystemData data{z.data(),
                        inputs ? inputs->data() : nullptr,
                        times.data(),
                        z.shape(0),
                        T,
                        estimates ? x.mutable_data() : nullptr,
                        estimates ? P.mutable_data() : nullptr};
  Status status = Status::ok;
  std::unique_ptr<AnyRecord> record;
  {
    py::gil_scoped_release release;
    record = AnyRecord::of(system, data, status);
  }
  if (status != Status::ok) return py::str(name(status));
  return py::make_tuple(py::cast(std::move(record)), x, P);
}

/// The record, and the status of every row.
py::tuple of_log(const AnySystem& system, const Array& x0, const Array& P0,
                 std::optional<Time> start, const py::array_t<Time, py::array::c_style>& stamp,
                 const py::array_t<std::int32_t, py::array::c_style>& sensor,
                 const py::array_t<double, py::array::c_style>& value,
                 const std::optional<Array>& factor) {
  const py::ssize_t N = stamp.shape(0);
  if (sensor.shape(0) != N || value.shape(0) != N)
    throw std::invalid_argument("stamp, sensor, value: expected one length");
  const desync::LogView log{stamp.data(), sensor.data(), value.data(), static_cast<std::size_t>(N),
                            factors(factor, N)};
  py::array_t<std::uint8_t> status(N);
  auto* data = reinterpret_cast<Status*>(status.mutable_data());
  const AnySystem::ModelBelief initial{vector(x0), matrix(P0)};
  std::unique_ptr<AnyRecord> record;
  {
    py::gil_scoped_release release;
    record = AnyRecord::of(system, initial, start, log, data);
  }
  return py::make_tuple(py::cast(std::move(record)), status);
}

py::ssize_t size_of(const AnyRecord& record) { return static_cast<py::ssize_t>(record.size()); }

template <class T, class F>
py::array_t<T> each(const AnyRecord& record, F&& f) {
  py::array_t<T> out(size_of(record));
  for (py::ssize_t i = 0; i < size_of(record); ++i)
    out.mutable_at(i) = f(static_cast<std::size_t>(i));
  return out;
}

void check(const AnyRecord& record, const Array& innovations) {
  if (innovations.ndim() != 2 || innovations.shape(1) != size_of(record))
    throw std::invalid_argument("innovations: expected (runs, measurements)");
}

Array whiten(const AnyRecord& record, const Array& innovations, int threads) {
  check(record, innovations);
  Array out({innovations.shape(0), size_of(record)});
  double* data = out.mutable_data();
  py::gil_scoped_release release;
  in_parts(innovations.shape(0), threads, 8, [&](std::int64_t first, std::int64_t last) {
    record.whiten({innovations.data(), first, last}, data);
  });
  return out;
}

Array precision(const AnyRecord& record) {
  Array out(size_of(record));
  double* data = out.mutable_data();
  py::gil_scoped_release release;
  record.precision(data);
  return out;
}

void check(const AnyRecord& record, const Direction& direction) {
  if (static_cast<int>(direction.size()) != record.channels())
    throw std::invalid_argument("direction: expected a weight for every channel");
}

/// (index of the measurement, G⁻¹, share) of every onset; None if the profile overflows.
py::object onsets(const AnyRecord& record, const Profile& profile, const Direction& direction) {
  check(record, direction);
  Onsets found;
  bool good = false;
  {
    py::gil_scoped_release release;
    good = record.onsets({profile, direction}, found);
  }
  if (!good) return py::none();
  const auto K = static_cast<py::ssize_t>(found.count);
  const py::ssize_t q = profile.amplitudes(), skipped = size_of(record) - K;
  py::array_t<std::int64_t> measurement(K);
  Array inverse({K, q, q}), share(K);
  std::copy_n(found.measurement.data() + skipped, K, measurement.mutable_data());
  std::copy_n(found.inverse.data() + skipped * q * q, K * q * q, inverse.mutable_data());
  std::copy_n(found.share.data() + skipped, K, share.mutable_data());
  return py::make_tuple(measurement, inverse, share);
}

/// S₀ᵀℓ (runs, K, q) of the K `onsets`; None if the profile overflows.
py::object scan(const AnyRecord& record, const Profile& profile, const Direction& direction,
                const Array& innovations, py::ssize_t onsets, int threads) {
  check(record, innovations);
  check(record, direction);
  const py::ssize_t runs = innovations.shape(0);
  Array out({runs, onsets, static_cast<py::ssize_t>(profile.amplitudes())});
  double* data = out.mutable_data();
  const Search search{profile, direction};
  bool good = true;
  {
    py::gil_scoped_release release;
    const auto parts = in_parts(runs, threads, 8, [&](std::int64_t first, std::int64_t last) {
      return static_cast<int>(record.scan(search, {innovations.data(), first, last},
                                          static_cast<std::size_t>(onsets), data));
    });
    for (const int part : parts) good &= part != 0;
  }
  return good ? py::object(std::move(out)) : py::object(py::none());
}

/// Innovations (q, measurements) of a fault that begins at `measurement`; None as above.
py::object response(const AnyRecord& record, const Profile& profile, const Direction& direction,
                    std::size_t measurement) {
  check(record, direction);
  if (measurement >= record.size()) throw std::invalid_argument("measurement: beyond the record");
  Array out({static_cast<py::ssize_t>(profile.amplitudes()), size_of(record)});
  const bool good = record.response({profile, direction}, measurement, out.mutable_data());
  return good ? py::object(std::move(out)) : py::object(py::none());
}

/// (G⁻¹ (F, 2, 2), share (F), numerators (runs, F, 2)) of cos and sin.
py::tuple spectrum(const AnyRecord& record, const Direction& direction, const Array& omega,
                   const Array& innovations, int threads) {
  check(record, innovations);
  check(record, direction);
  const py::ssize_t F = omega.shape(0), runs = innovations.shape(0);
  Array inverse({F, py::ssize_t{2}, py::ssize_t{2}}), share(F), out({runs, F, py::ssize_t{2}});
  double *inverses = inverse.mutable_data(), *shares = share.mutable_data();
  double* data = out.mutable_data();
  {
    py::gil_scoped_release release;
    in_parts(F, threads, 8, [&](std::int64_t first, std::int64_t last) {
      const FrequencyRange range{omega.data(), static_cast<std::size_t>(F),
                                 static_cast<std::size_t>(first), static_cast<std::size_t>(last)};
      record.spectrum(direction, range, {innovations.data(), 0, runs}, {inverses, shares, data});
    });
  }
  return py::make_tuple(inverse, share, out);
}

Array wave(const AnyRecord& record, const Direction& direction, double omega) {
  check(record, direction);
  Array out({py::ssize_t{2}, size_of(record)});
  record.wave(direction, omega, out.mutable_data());
  return out;
}

std::unique_ptr<AnyGradient> make_gradient(const LinearSystem& system) {
  std::unique_ptr<AnyGradient> out;
  const ConfigStatus status = AnyGradient::make(system, out);
  if (status != ConfigStatus::ok) throw std::invalid_argument(name(status));
  return out;
}

/// ∂𝓛/∂z (T, m), or None where the arguments are not plainly what they should be: the Python face
/// then says what is wrong with them.
py::object gradient(const AnyGradient& engine, const py::handle& z, const py::handle& inputs) {
  using Plain = py::array_t<double, py::array::c_style>;
  if (!py::isinstance<Plain>(z)) return py::none();
  const auto values = py::reinterpret_borrow<Plain>(z);
  const bool column = values.ndim() == 1 && engine.measured() == 1;
  if (!column && (values.ndim() != 2 || values.shape(1) != engine.measured())) return py::none();
  const py::ssize_t T = values.shape(0);
  if (T == 0 || (engine.steps() != 0 && T != engine.steps())) return py::none();
  const double* known = nullptr;
  if (!inputs.is_none()) {
    if (!py::isinstance<Plain>(inputs)) return py::none();
    const auto given = py::reinterpret_borrow<Plain>(inputs);
    if (given.ndim() != 2 || given.shape(0) != T - 1 || given.shape(1) != engine.size())
      return py::none();
    known = given.data();
  }
  Plain out(std::vector<py::ssize_t>(values.shape(), values.shape() + values.ndim()));
  double* data = out.mutable_data();
  bool good = false;
  {
    py::gil_scoped_release release;
    const Status status = engine.run(values.data(), static_cast<int>(T), known, data);
    double sum = 0.0;
    for (py::ssize_t i = 0; i < out.size(); ++i) sum += data[i] * 0.0;
    good = status == Status::ok && sum == 0.0;
  }
  return good ? py::object(std::move(out)) : py::object(py::none());
}

const char* add_search(AnySliding& sliding, const Profile& profile, const Direction& direction,
                       double false_alarm) {
  AnySliding::Direction weights{};
  if (direction.size() > weights.size()) throw std::invalid_argument("direction: too many sensors");
  std::copy(direction.begin(), direction.end(), weights.begin());
  return name(sliding.add(profile, weights, false_alarm));
}

/// (name, onset [ns], drop, bound on p, amplitudes, standard errors, number of onsets).
py::tuple look(const AnySliding& sliding, int search) {
  static constexpr std::array<const char*, 3> names{"undetectable", "not detected", "detected"};
  const SlidingFinding found = sliding.look(search);
  return py::make_tuple(names[static_cast<std::size_t>(found.finding)], found.onset, found.drop,
                        found.p_bound, to_numpy(Eigen::VectorXd(found.amplitude)),
                        to_numpy(Eigen::VectorXd(found.deviation)), found.onsets);
}

}  // namespace

void bind_drift(py::module_& module) {
  module.attr("DETECTABLE") = detectable;
  module.attr("MAX_PROFILE_STATES") = static_cast<int>(Profile::max_size);
  py::class_<Profile>(module, "DriftProfile")
      .def(py::init(&make_profile), py::arg("A"), py::arg("output"), py::arg("onset"))
      .def_static("pulse", &Profile::pulse)
      .def("states", &states, py::arg("elapsed"));

  py::class_<AnyRecord>(module, "DriftRecord")
      .def_static("of_system", &of_system, py::arg("system"), py::arg("z"), py::arg("inputs"),
                  py::arg("times"), py::arg("estimates"))
      .def_static("of_log", &of_log, py::arg("system"), py::arg("x0"), py::arg("P0"),
                  py::arg("start"), py::arg("stamp"), py::arg("sensor"), py::arg("value"),
                  py::arg("factor"))
      .def_property_readonly("size", &AnyRecord::size)
      .def_property_readonly("mixed", &AnyRecord::mixed)
      .def_property_readonly("innovations",
                             [](const py::object& self) {
                               const auto& record = self.cast<const AnyRecord&>();
                               const py::ssize_t N = size_of(record);
                               const auto runs =
                                   static_cast<py::ssize_t>(record.log_likelihood.size());
                               return Array({runs, N}, record.innovations.data(), self);
                             })
      .def_property_readonly("log_likelihood",
                             [](const AnyRecord& record) {
                               const auto& all = record.log_likelihood;
                               return Array(static_cast<py::ssize_t>(all.size()), all.data());
                             })
      .def_property_readonly("ids",
                             [](const AnyRecord& record) {
                               return each<std::int64_t>(
                                   record, [&](std::size_t i) { return record.id(i); });
                             })
      .def_property_readonly("inverse",
                             [](const AnyRecord& record) {
                               return each<double>(
                                   record, [&](std::size_t i) { return record.inverse(i); });
                             })
      .def_property_readonly("noise",
                             [](const AnyRecord& record) {
                               return each<double>(record,
                                                   [&](std::size_t i) { return record.noise(i); });
                             })
      .def(
          "weights",
          [](const AnyRecord& record, const Direction& direction) {
            check(record, direction);
            return each<double>(record,
                                [&](std::size_t i) { return record.weight(i, direction.data()); });
          },
          py::arg("direction"))
      .def("whiten", &whiten, py::arg("innovations"), py::arg("threads"))
      .def("precision", &precision)
      .def("onsets", &onsets, py::arg("profile"), py::arg("direction"))
      .def("scan", &scan, py::arg("profile"), py::arg("direction"), py::arg("innovations"),
           py::arg("onsets"), py::arg("threads"))
      .def("response", &response, py::arg("profile"), py::arg("direction"), py::arg("measurement"))
      .def("spectrum", &spectrum, py::arg("direction"), py::arg("omega"), py::arg("innovations"),
           py::arg("threads"))
      .def("wave", &wave, py::arg("direction"), py::arg("omega"));

  module.attr("MAX_SEARCHES") = static_cast<int>(AnySliding::max_searches);
  py::class_<AnySliding>(module, "SlidingEngine")
      .def(py::init([](const AnySystem& system, const Array& x, const Array& P,
                       std::optional<Time> start, std::size_t capacity, std::size_t window) {
             return AnySliding::make(system, {vector(x), matrix(P)}, start, capacity, window);
           }),
           py::arg("system"), py::arg("x"), py::arg("P"), py::arg("start"), py::arg("capacity"),
           py::arg("window"))
      .def("add", &add_search, py::arg("profile"), py::arg("direction"), py::arg("false_alarm"))
      .def(
          "push",
          [](AnySliding& sliding, Time stamp, std::int32_t sensor, double value, std::int64_t id,
             double factor) {
            return static_cast<int>(sliding.push(stamp, sensor, value, id, factor));
          },
          py::arg("stamp"), py::arg("sensor"), py::arg("value"), py::arg("id"), py::arg("factor"))
      .def(
          "estimate",
          [](AnySliding& sliding, Time time) {
            desync::StepError error;
            const Status status = sliding.estimate(time, error);
            const auto belief = sliding.belief();
            return py::make_tuple(name(status), to_numpy(belief.x), to_numpy(belief.P));
          },
          py::arg("time"))
      .def("look", &look, py::arg("search"))
      .def("clear", &AnySliding::clear)
      .def_property_readonly("size", &AnySliding::size);

  py::class_<AnyGradient>(module, "GradientEngine")
      .def(py::init(&make_gradient), py::arg("system"))
      .def("run", &gradient, py::arg("z"), py::arg("inputs"));
}

}  // namespace surefix::bindings
