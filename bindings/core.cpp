#include <pybind11/stl.h>

#include "arrays.hpp"
#include "surefix/core/any_system.hpp"
#include "surefix/core/distributions.hpp"
#include "surefix/core/linear_system.hpp"

namespace surefix::bindings {
namespace {

AnyModel chain(int integrators, bool position, double root_density) {
  if (integrators == 1 && !position) return AnyModel(ConstantVelocity(root_density));
  if (integrators == 2 && position) return AnyModel(ConstantVelocityWithPosition(root_density));
  if (integrators == 2) return AnyModel(ConstantAcceleration(root_density));
  return AnyModel(ConstantAccelerationWithPosition(root_density));
}

AnyModel::Matrix bounded(const Array& array) {
  if (array.ndim() != 2 || array.shape(0) > AnyModel::max_size || array.shape(0) != array.shape(1))
    throw std::invalid_argument("model matrix: expected at most 8 x 8, square");
  return matrix(array);
}

/// F and Q over `elapsed`, or the name of the status that says why not.
py::tuple transition(const AnyModel& model, Time elapsed) {
  AnyModel::Transition out;
  const Status status = model.transition(elapsed, out);
  if (status != Status::ok) return py::make_tuple(name(status), py::none(), py::none());
  return py::make_tuple("ok", to_numpy(out.F), to_numpy(out.Q));
}

AnySystem make_system(const AnyModel& model, const Array& observes, const Array& sigma,
                      const IntArray& latency, const Array& scale_sigma, const Array& scale_time,
                      const Array& bias_sigma, const Array& bias_time) {
  AnySystem system(model);
  for (py::ssize_t s = 0; s < sigma.shape(0); ++s) {
    AnySystem::SensorType sensor;
    sensor.observes.resize(observes.shape(1));
    for (py::ssize_t i = 0; i < observes.shape(1); ++i) sensor.observes(i) = observes.at(s, i);
    sensor.sigma = sigma.at(s);
    sensor.latency = latency.at(s);
    sensor.scale = {scale_sigma.at(s), scale_time.at(s)};
    sensor.bias = {bias_sigma.at(s), bias_time.at(s)};
    const ConfigStatus status = system.add(sensor);
    if (status != ConfigStatus::ok)
      throw std::invalid_argument("sensor " + std::to_string(s) + " refused, status " +
                                  std::to_string(static_cast<int>(status)));
  }
  const ConfigStatus status = system.check();
  if (status != ConfigStatus::ok)
    throw std::invalid_argument("model refused, status " +
                                std::to_string(static_cast<int>(status)));
  return system;
}

/// Full F and Q of a system with its sensor states.
py::tuple system_transition(const AnySystem& system, Time elapsed) {
  AnySystem::Transition t;
  const Status status = system.transition(elapsed, t);
  if (status != Status::ok) return py::make_tuple(name(status), py::none(), py::none());
  const int n = system.state_size();
  Eigen::MatrixXd F = Eigen::MatrixXd::Identity(n, n), Q = Eigen::MatrixXd::Zero(n, n);
  for (int j = 0; j < n; ++j) t.apply(F.col(j));
  t.add_noise(Q);
  return py::make_tuple("ok", to_numpy(F), to_numpy(Q));
}

/// A sensor's row at state x, and the reading it predicts there.
py::tuple system_row(const AnySystem& system, int sensor, const Array& x) {
  const Eigen::VectorXd state = vector(x);
  const Reading reading = system.read(sensor, state);
  Eigen::VectorXd row = Eigen::VectorXd::Zero(system.state_size());
  system.with_row(sensor, reading.at, row, [](const auto& h, Eigen::VectorXd& out) {
    h.for_each([&](int i, double value) { out(i) = value; });
    return true;
  });
  return py::make_tuple(to_numpy(row), reading.predicted);
}

LinearSystem make_linear(const Array& A, const Array& Q, const Array& H, const Array& R,
                         const Array& x0, const Array& P0) {
  return {matrices(A), matrices(Q), matrices(H), matrices(R), vector(x0), matrix(P0)};
}

}  // namespace

void bind_core(py::module_& module) {
  std::vector<std::string> names;
  for (int i = 0; i < status_count; ++i) names.emplace_back(name(static_cast<Status>(i)));
  module.attr("STATUS_NAMES") = py::tuple(py::cast(names));
  module.attr("MAX_SECONDS") = max_seconds;
  module.attr("MAX_LATENCY") = max_latency;
  module.attr("MAX_MODEL_STATES") = static_cast<int>(AnyModel::max_size);
  module.attr("MAX_SENSORS") = 16;

  module.def("normal_two_sided", py::vectorize(normal_two_sided), py::arg("risk"));
  module.def("chi_squared_tail", py::vectorize(chi_squared_tail), py::arg("x"), py::arg("degrees"));
  module.def("chi_squared_threshold", py::vectorize(chi_squared_threshold), py::arg("probability"),
             py::arg("degrees"));

  module.def("noncentral_chi_squared_tail", py::vectorize(noncentral_chi_squared_tail),
             py::arg("x"), py::arg("degrees"), py::arg("noncentrality"));
  module.def("noncentral_chi_squared_cdf", py::vectorize(noncentral_chi_squared_cdf), py::arg("x"),
             py::arg("degrees"), py::arg("noncentrality"));
  module.def("noncentral_chi_squared_density", py::vectorize(noncentral_chi_squared_density),
             py::arg("x"), py::arg("degrees"), py::arg("noncentrality"));
  module.def("noncentrality_for", py::vectorize(noncentrality_for), py::arg("missed"), py::arg("x"),
             py::arg("degrees"));

  py::class_<AnyModel>(module, "Model")
      .def_static("chain", &chain, py::arg("integrators"), py::arg("position"),
                  py::arg("root_density"))
      .def_static(
          "linear",
          [](const Array& A, const Array& W) {
            return AnyModel(AnyModel::Linear(bounded(A), bounded(W)));
          },
          py::arg("A"), py::arg("W"))
      .def_static(
          "discrete",
          [](const Array& F, const Array& Q, Time period) {
            return AnyModel(AnyModel::Discrete(bounded(F), bounded(Q), period));
          },
          py::arg("F"), py::arg("Q"), py::arg("period"))
      .def_property_readonly("size", &AnyModel::state_size)
      .def("transition", &transition, py::arg("elapsed"));

  module.attr("MAX_LINEAR_SIZE") = AnyLinearSizes::max_n;
  py::class_<LinearSystem>(module, "LinearSystemEngine")
      .def(py::init(&make_linear), py::arg("A"), py::arg("Q"), py::arg("H"), py::arg("R"),
           py::arg("x0"), py::arg("P0"));

  py::class_<AnySystem>(module, "System")
      .def(py::init(&make_system), py::arg("model"), py::arg("observes"), py::arg("sigma"),
           py::arg("latency"), py::arg("scale_sigma"), py::arg("scale_time"), py::arg("bias_sigma"),
           py::arg("bias_time"))
      .def_property_readonly("size", &AnySystem::state_size)
      .def_property_readonly("sensor_count", &AnySystem::sensor_count)
      .def("scale_state", &AnySystem::scale_state, py::arg("sensor"))
      .def("bias_state", &AnySystem::bias_state, py::arg("sensor"))
      .def("transition", &system_transition, py::arg("elapsed"))
      .def("row", &system_row, py::arg("sensor"), py::arg("x"));
}

}  // namespace surefix::bindings
