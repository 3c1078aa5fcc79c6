#include <pybind11/stl.h>

#include <algorithm>
#include <memory>

#include "arrays.hpp"
#include "surefix/raim/affine_fit.hpp"
#include "surefix/raim/follower.hpp"
#include "surefix/raim/linear_test.hpp"
#include "surefix/raim/power.hpp"
#include "surefix/raim/track_raim.hpp"

namespace surefix::bindings {
namespace {

using namespace surefix::raim;

void expect(ConfigStatus status, const char* what) {
  if (status != ConfigStatus::ok)
    throw std::invalid_argument(std::string(what) + ": " + name(status));
}

LinearTest make_test(const Array& H, const Array& M, const Array& L) {
  LinearTest test;
  expect(LinearTest::make(matrix(H), matrix(M), matrix(L), test), "linear test");
  return test;
}

/// Λ of every row of Y (epochs, n).
Array statistics(const LinearTest& test, const Array& Y) {
  if (Y.ndim() != 2 || Y.shape(1) != test.size()) throw std::invalid_argument("Y: wrong shape");
  Array out(Y.shape(0));
  for (py::ssize_t t = 0; t < Y.shape(0); ++t) out.mutable_at(t) = test.statistic(Y.data(t, 0));
  return out;
}

Array parities(const LinearTest& test, const Array& Y) {
  if (Y.ndim() != 2 || Y.shape(1) != test.size()) throw std::invalid_argument("Y: wrong shape");
  Array out({Y.shape(0), static_cast<py::ssize_t>(test.W().rows())});
  for (py::ssize_t t = 0; t < Y.shape(0); ++t)
    test.parity(Y.data(t, 0), out.mutable_data() + t * test.W().rows());
  return out;
}

py::tuple fit(const Array& X, const Array& values, bool minimax) {
  if (values.ndim() != 2 || X.ndim() != 2 || X.shape(0) != values.shape(0))
    throw std::invalid_argument("X, values: expected (k, m), (k, n)");
  const AffineFit found = minimax ? fit_minimax(matrix(X), matrix(values))
                                  : fit_least_squares(matrix(X), matrix(values));
  return py::make_tuple(to_numpy(found.A), to_numpy(found.B), to_numpy(found.rho));
}

/// A member of ChiSquaredTest as a function of (noncentrality, bound, degrees, threshold).
template <double (ChiSquaredTest::*member)(double, double) const noexcept>
double bent(double noncentrality, double bound, double degrees, double threshold) {
  return (ChiSquaredTest{degrees, threshold}.*member)(noncentrality, bound);
}
template <double (ChiSquaredTest::*member)(double) const noexcept>
double worst(double bound, double degrees, double threshold) {
  return (ChiSquaredTest{degrees, threshold}.*member)(bound);
}

std::shared_ptr<Track> make_track(const Array& points, const std::optional<Array>& mileage,
                                  double tolerance, double start) {
  auto track = std::make_shared<Track>();
  expect(mileage ? Track::make(matrix(points), vector(*mileage), tolerance, *track)
                 : Track::make(matrix(points), tolerance, start, *track),
         "track");
  return track;
}

/// Position, tangent and bend (k, 3) at every mileage (k).
py::tuple track_at(const Track& track, const Array& l) {
  const py::ssize_t k = l.shape(0);
  Array position({k, py::ssize_t{3}}), tangent({k, py::ssize_t{3}}), bend({k, py::ssize_t{3}});
  for (py::ssize_t i = 0; i < k; ++i) {
    const TrackPoint point = track.at(l.at(i));
    for (py::ssize_t j = 0; j < 3; ++j) {
      const auto axis = static_cast<std::size_t>(j);
      position.mutable_at(i, j) = point.position[axis];
      tangent.mutable_at(i, j) = point.tangent[axis];
      bend.mutable_at(i, j) = point.bend[axis];
    }
  }
  return py::make_tuple(position, tangent, bend);
}

Array nearest(const Track& track, const Array& positions) {
  Array out(positions.shape(0));
  py::gil_scoped_release release;
  for (py::ssize_t i = 0; i < positions.shape(0); ++i)
    out.mutable_data()[i] = track.nearest(
        {positions.data()[3 * i], positions.data()[3 * i + 1], positions.data()[3 * i + 2]});
  return out;
}

/// A monitor and the track that it needs.
struct Monitor {
  std::shared_ptr<Track> track;
  TrackRaim raim;
};

std::unique_ptr<Monitor> make_monitor(std::shared_ptr<Track> track, double length,
                                      double false_alarm, double missed, double risk,
                                      double fault_probability, int max_faults, int max_excluded,
                                      double interval, double rotation) {
  const MonitorSettings settings{length,     false_alarm,  missed,   risk,    fault_probability,
                                 max_faults, max_excluded, interval, rotation};
  expect(settings.check(), "monitor");
  const Track& place = *track;
  return std::make_unique<Monitor>(Monitor{std::move(track), TrackRaim(place, settings)});
}

/// The columns of all epochs: of every epoch (T), its systems (T, 8), every satellite (N).
struct Columns {
  Columns(py::ssize_t T, py::ssize_t N)
      : status(T),
        declared(T),
        used(T),
        excluded(T),
        degrees(T),
        alarm(T),
        separation_alarm(T),
        available(T),
        available_with_e1(T),
        taken_out(N),
        clock({T, py::ssize_t{max_systems}}) {
    for (auto* column : {&along, &sigma, &statistic, &threshold, &rival, &p_star, &bound,
                         &bound_along, &e1, &e2, &snapshot_protection, &protection})
      *column = Array(T);
    for (auto* column : {&residual, &critical_bias, &missed}) *column = Array(N);
  }

  void put(py::ssize_t t, py::ssize_t begin, py::ssize_t end, const Verdict& v) {
    status.mutable_data()[t] = static_cast<std::uint8_t>(v.status);
    declared.mutable_data()[t] = static_cast<std::uint8_t>(v.declared);
    used.mutable_data()[t] = v.used;
    excluded.mutable_data()[t] = v.excluded;
    degrees.mutable_data()[t] = v.degrees;
    alarm.mutable_data()[t] = v.alarm;
    separation_alarm.mutable_data()[t] = v.separation_alarm;
    available.mutable_data()[t] = v.available;
    available_with_e1.mutable_data()[t] = v.available_with_e1;
    along.mutable_data()[t] = v.along;
    sigma.mutable_data()[t] = v.sigma;
    statistic.mutable_data()[t] = v.statistic;
    threshold.mutable_data()[t] = v.threshold;
    rival.mutable_data()[t] = v.rival;
    p_star.mutable_data()[t] = v.p_star;
    bound.mutable_data()[t] = v.bound;
    bound_along.mutable_data()[t] = v.bound_along;
    e1.mutable_data()[t] = v.e1;
    e2.mutable_data()[t] = v.e2;
    snapshot_protection.mutable_data()[t] = v.snapshot_protection;
    protection.mutable_data()[t] = v.protection;
    for (std::size_t c = 0; c < max_systems; ++c)
      clock.mutable_data()[t * max_systems + static_cast<py::ssize_t>(c)] = v.clock[c];
    for (py::ssize_t k = begin; k < end; ++k) {
      const auto i = static_cast<std::size_t>(k - begin);
      const bool known = i < v.residual.size();
      taken_out.mutable_data()[k] = known && v.taken_out[i];
      residual.mutable_data()[k] = known ? v.residual[i] : Verdict::none;
      critical_bias.mutable_data()[k] = known ? v.critical_bias[i] : Verdict::none;
      missed.mutable_data()[k] = known ? v.missed[i] : Verdict::none;
    }
  }

  [[nodiscard]] py::dict named() const {
    py::dict out;
    out["status"] = status, out["declared"] = declared, out["used"] = used;
    out["excluded_count"] = excluded, out["degrees"] = degrees, out["alarm"] = alarm;
    out["separation_alarm"] = separation_alarm, out["available"] = available;
    out["available_with_e1"] = available_with_e1, out["along"] = along, out["sigma"] = sigma;
    out["statistic"] = statistic, out["threshold"] = threshold, out["p_star"] = p_star,
    out["rival"] = rival;
    out["bound"] = bound, out["bound_along"] = bound_along, out["e1"] = e1, out["e2"] = e2,
    out["clock"] = clock;
    out["protection_chi2"] = snapshot_protection, out["protection"] = protection;
    out["excluded"] = taken_out, out["residual"] = residual, out["critical_bias"] = critical_bias;
    out["missed_at_critical"] = missed;
    return out;
  }

  py::array_t<std::uint8_t> status, declared;
  py::array_t<std::int32_t> used, excluded, degrees;
  py::array_t<bool> alarm, separation_alarm, available, available_with_e1, taken_out;
  Array along, sigma, statistic, threshold, rival, p_star, bound, bound_along, e1, e2,
      snapshot_protection, protection, residual, critical_bias, missed, clock;
};

/// Epoch t holds the rows begin[t] … begin[t + 1] − 1.
py::dict judge(const Monitor& monitor, const Array& time, const IntArray& begin,
               const Array& position, const Array& pseudorange, const Array& sigma,
               const IntArray& system, double max_speed, double near,
               const py::function& progress) {
  const py::ssize_t T = time.shape(0), N = pseudorange.shape(0);
  if (begin.shape(0) != T + 1 || begin.at(0) < 0 || begin.at(T) > N || position.shape(0) != N ||
      sigma.shape(0) != N || system.shape(0) != N)
    throw std::invalid_argument("epochs: wrong sizes");
  constexpr py::ssize_t chunk = 2000;
  Columns columns(T, N);
  Follower follower(monitor.raim, max_speed, near);
  std::vector<Satellite> epoch;
  for (py::ssize_t done = 0; done < T; done += chunk) {
    {
      py::gil_scoped_release release;
      for (py::ssize_t t = done; t < std::min(done + chunk, T); ++t) {
        const py::ssize_t first = begin.data()[t], end = begin.data()[t + 1];
        epoch.clear();
        for (py::ssize_t k = first; k < end; ++k) {
          const double* p = position.data() + 3 * k;
          epoch.push_back({{p[0], p[1], p[2]},
                           pseudorange.data()[k],
                           sigma.data()[k],
                           static_cast<int>(system.data()[k])});
        }
        const int n = static_cast<int>(epoch.size());
        columns.put(t, first, end, follower.judge(time.data()[t], epoch.data(), n));
      }
    }
    progress(std::min(done + chunk, T), T);
  }
  return columns.named();
}

template <class Enum>
py::tuple names(int count) {
  std::vector<std::string> out;
  for (int i = 0; i < count; ++i) out.emplace_back(name(static_cast<Enum>(i)));
  return py::tuple(py::cast(out));
}

}  // namespace

void bind_raim(py::module_& module) {
  module.attr("RAIM_STATUS_NAMES") = names<Solvable>(7);
  module.attr("DECLARED_NAMES") = names<Declared>(4);
  module.attr("MAX_SATELLITES") = max_satellites;
  module.attr("MAX_SATELLITE_SYSTEMS") = max_systems;
  module.attr("MAX_EXCLUDED") = max_set;
  module.attr("EARTH_ROTATION") = earth_rotation;

  const auto lambda = py::arg("noncentrality");
  module.def("least_power", py::vectorize(&bent<&ChiSquaredTest::least_power>), lambda,
             py::arg("bound"), py::arg("degrees"), py::arg("threshold"));
  module.def("most_power", py::vectorize(&bent<&ChiSquaredTest::most_power>), lambda,
             py::arg("bound"), py::arg("degrees"), py::arg("threshold"));
  module.def("power_loss", py::vectorize(&bent<&ChiSquaredTest::loss>), lambda, py::arg("bound"),
             py::arg("degrees"), py::arg("threshold"));
  module.def("power_gain", py::vectorize(&bent<&ChiSquaredTest::gain>), lambda, py::arg("bound"),
             py::arg("degrees"), py::arg("threshold"));
  module.def("worst_power_loss", py::vectorize(&worst<&ChiSquaredTest::worst_loss>),
             py::arg("bound"), py::arg("degrees"), py::arg("threshold"));
  module.def("worst_power_gain", py::vectorize(&worst<&ChiSquaredTest::worst_gain>),
             py::arg("bound"), py::arg("degrees"), py::arg("threshold"));

  py::class_<LinearTest>(module, "LinearTestEngine")
      .def(py::init(&make_test), py::arg("H"), py::arg("M"), py::arg("L"))
      .def_property_readonly("W", [](const LinearTest& t) { return to_numpy(t.W()); })
      .def_property_readonly("whitening",
                             [](const LinearTest& t) { return to_numpy(t.whitening()); })
      .def_property_readonly("rank", &LinearTest::rank)
      .def_property_readonly("degrees", &LinearTest::degrees)
      .def("statistic", &statistics, py::arg("Y"))
      .def("parity", &parities, py::arg("Y"));
  module.def("affine_fit", &fit, py::arg("X"), py::arg("values"), py::arg("minimax"));

  py::class_<Track, std::shared_ptr<Track>>(module, "TrackEngine")
      .def(py::init(&make_track), py::arg("points"), py::arg("mileage"), py::arg("tolerance"),
           py::arg("start"))
      .def_property_readonly("low", &Track::low)
      .def_property_readonly("high", &Track::high)
      .def_property_readonly("error", &Track::error)
      .def_property_readonly("edge_error", &Track::edge_error)
      .def("at", &track_at, py::arg("along"))
      .def("bend_bound", &Track::bend_bound, py::arg("low"), py::arg("high"))
      .def("curvature_bound", &Track::curvature_bound, py::arg("low"), py::arg("high"))
      .def("nearest", &nearest, py::arg("positions"));

  py::class_<Monitor>(module, "TrackRaimEngine")
      .def(py::init(&make_monitor), py::arg("track"), py::arg("length"), py::arg("false_alarm"),
           py::arg("missed"), py::arg("risk"), py::arg("fault_probability"), py::arg("max_faults"),
           py::arg("max_excluded"), py::arg("interval"), py::arg("rotation"))
      .def("judge", &judge, py::arg("time"), py::arg("begin"), py::arg("position"),
           py::arg("pseudorange"), py::arg("sigma"), py::arg("system"), py::arg("max_speed"),
           py::arg("near"), py::arg("progress"));
}

}  // namespace surefix::bindings
