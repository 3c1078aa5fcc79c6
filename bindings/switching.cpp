#include <pybind11/stl.h>

#include "arrays.hpp"
#include "surefix/switching/any_filter.hpp"
#include "threads.hpp"

namespace surefix::bindings {
namespace {

using namespace surefix::switching;

/// What is wrong, its row, column and value.
py::tuple problem(const ChainStatus& status) {
  static constexpr std::array<const char*, 9> names{"ok",      "wrong_size", "gamma",
                                                    "delta",   "negative",   "row_sum",
                                                    "initial", "reducible",  "lumped"};
  return py::make_tuple(names[static_cast<std::size_t>(status.what)], status.row, status.column,
                        status.value);
}

/// The chain, or what is wrong with it.
py::object or_problem(const ChainStatus& status, const ModeChain& chain) {
  return status ? py::cast(chain) : py::object(problem(status));
}

py::object make_chain(const std::vector<std::pair<double, double>>& modes, const Array& transition,
                      const std::optional<Array>& initial) {
  std::vector<Mode> pairs;
  for (const auto& [gamma, delta] : modes) pairs.push_back({gamma, delta});
  ModeChain chain;
  const ChainStatus status = ModeChain::make(pairs, matrix(transition),
                                             initial ? vector(*initial) : Eigen::VectorXd(), chain);
  return or_problem(status, chain);
}

py::object make_filter(Method method, const std::vector<LinearSystem>& systems,
                       const ModeChain& chain, const Array& p, const StateMap& map) {
  std::unique_ptr<AnyFilter> out;
  const ConfigStatus status = AnyFilter::make(method, {systems, chain, matrices(p), map}, out);
  return status == ConfigStatus::ok ? py::cast(std::move(out)) : py::object(py::str(name(status)));
}

py::object make_genie(const LinearSystem& system,
                      const std::vector<std::pair<double, double>>& modes) {
  std::vector<Mode> pairs;
  for (const auto& [gamma, delta] : modes) pairs.push_back({gamma, delta});
  std::unique_ptr<AnyFilter> out;
  const ConfigStatus status = AnyFilter::make_genie(system, pairs, out);
  return status == ConfigStatus::ok ? py::cast(std::move(out)) : py::object(py::str(name(status)));
}

/// All series in one call: (x, P, mode, log-likelihood, name of the status, run and step of the
/// first that failed). The GIL is released while it runs.
template <class Filter>
py::tuple run(const Filter& filter, const py::array_t<double, py::array::c_style>& z,
              const std::optional<py::array_t<std::int32_t, py::array::c_style>>& modes, int n,
              int M, int threads) {
  if (z.ndim() != 3) throw std::invalid_argument("z: expected (runs, steps, m)");
  const py::ssize_t runs = z.shape(0), T = z.shape(1);
  if (modes && (modes->ndim() != 2 || modes->shape(0) != runs || modes->shape(1) != T))
    throw std::invalid_argument("modes: expected (runs, steps)");
  Block block(8 * runs * (T * (n + n * n + M) + 1));
  auto x = block.take<double>({runs, T, n}), P = block.take<double>({runs, T, n, n});
  auto mode = block.take<double>({runs, T, M});
  auto log_likelihood = block.take<double>({runs});
  const BatchOutput out{x.mutable_data(), P.mutable_data(), M > 0 ? mode.mutable_data() : nullptr,
                        log_likelihood.mutable_data()};
  BatchRequest request{z.data(), modes ? modes->data() : nullptr, 0, 0, static_cast<int>(T)};
  BatchStatus status;
  {
    py::gil_scoped_release release;
    const auto parts = in_parts(runs, threads, 8, [&](std::int64_t first, std::int64_t last) {
      BatchRequest own = request;
      own.first = first;
      own.last = last;
      return first < last ? filter.run(own, out) : BatchStatus{};
    });
    for (const BatchStatus& part : parts)
      if (status.status == Status::ok) status = part;
  }
  return py::make_tuple(x, P, mode, log_likelihood, name(status.status), status.run, status.step);
}

}  // namespace

void bind_switching(py::module_& module) {
  py::class_<StateMap>(module, "StateMap")
      .def(py::init([](const std::vector<std::vector<int>>& states, const std::vector<double>& mean,
                       const std::vector<double>& variance) {
             StateMap map{states, {}, mean, variance};
             for (int i = 0; i < map.size(); ++i) map.all.push_back(i);
             return map;
           }),
           py::arg("states"), py::arg("mean"), py::arg("variance"));

  py::class_<ModeChain>(module, "ModeChainEngine")
      .def_static("make", &make_chain, py::arg("modes"), py::arg("transition"), py::arg("initial"))
      .def_static(
          "restore",
          [](const std::vector<double>& gamma,
             const std::vector<std::vector<std::pair<double, double>>>& branches,
             const Array& transition, const Array& initial) {
            ModeChain chain{gamma, {}, matrix(transition), vector(initial)};
            for (const auto& mode : branches) {
              chain.branches.emplace_back();
              for (const auto& [delta, share] : mode)
                chain.branches.back().push_back({delta, share});
            }
            return chain;
          },
          py::arg("gamma"), py::arg("branches"), py::arg("transition"), py::arg("initial"))
      .def_static(
          "independent",
          [](const std::vector<double>& gamma, const Array& gamma_transition,
             const std::vector<double>& delta, const Array& delta_transition) {
            ModeChain chain;
            const ChainStatus status = ModeChain::independent(
                gamma, matrix(gamma_transition), delta, matrix(delta_transition), chain);
            return or_problem(status, chain);
          },
          py::arg("gamma"), py::arg("gamma_transition"), py::arg("delta"),
          py::arg("delta_transition"))
      .def(
          "lumped",
          [](const ModeChain& chain, const std::vector<std::vector<int>>& groups,
             const Array& law) {
            ModeChain out;
            const ChainStatus status = chain.lumped(groups, vector(law), out);
            return or_problem(status, out);
          },
          py::arg("groups"), py::arg("law"))
      .def_readonly("gamma", &ModeChain::gamma)
      .def_property_readonly("branches",
                             [](const ModeChain& chain) {
                               py::list modes;
                               for (const auto& branches : chain.branches) {
                                 py::list mode;
                                 for (const Branch& b : branches)
                                   mode.append(py::make_tuple(b.delta, b.share));
                                 modes.append(mode);
                               }
                               return modes;
                             })
      .def_property_readonly("transition",
                             [](const ModeChain& chain) { return to_numpy(chain.transition); })
      .def_property_readonly("initial",
                             [](const ModeChain& chain) { return to_numpy(chain.initial); });

  module.def(
      "check_transition",
      [](const Array& P) -> py::object {
        Eigen::MatrixXd checked = matrix(P);
        const ChainStatus status = check_transition(checked, static_cast<int>(checked.rows()));
        return status ? py::object(to_numpy(checked)) : py::object(problem(status));
      },
      py::arg("P"));
  module.def(
      "stationary",
      [](const Array& P) -> py::object {
        Eigen::VectorXd law;
        const ChainStatus status = stationary(matrix(P), law);
        return status ? py::object(to_numpy(law)) : py::object(py::none());
      },
      py::arg("P"));
  module.def(
      "transition_over",
      [](const Array& rates, double dt) -> py::object {
        Eigen::MatrixXd P;
        const ConfigStatus status = transition_over(matrix(rates), dt, P);
        return status == ConfigStatus::ok ? py::object(to_numpy(P))
                                          : py::object(py::str(name(status)));
      },
      py::arg("rates"), py::arg("dt"));
  module.def(
      "check_linear",
      [](const ModeChain& chain, const Array& p, int steps) {
        const LinearCondition c = check_linear(chain, matrices(p), steps);
        return py::make_tuple(c.holds, c.p11, c.lowest, c.highest, c.spread, c.lags);
      },
      py::arg("chain"), py::arg("p"), py::arg("steps"));

  py::class_<AnyFilter>(module, "SwitchingEngine")
      .def_static(
          "one_step",
          [](const LinearSystem& system, const ModeChain& chain, const Array& p) {
            return make_filter(Method::one_step, {system}, chain, p, {});
          },
          py::arg("system"), py::arg("chain"), py::arg("p"))
      .def_static(
          "imm",
          [](const std::vector<LinearSystem>& systems, const ModeChain& chain, const Array& p,
             const std::optional<StateMap>& map) {
            return make_filter(Method::imm, systems, chain, p, map.value_or(StateMap{}));
          },
          py::arg("systems"), py::arg("chain"), py::arg("p"), py::arg("map"))
      .def_static("genie", &make_genie, py::arg("system"), py::arg("modes"))
      .def("run", &run<AnyFilter>, py::arg("z").noconvert(), py::arg("modes"), py::arg("n"),
           py::arg("M"), py::arg("threads"));

  py::class_<AnyLinearFilter>(module, "LinearFilterEngine")
      .def_static(
          "make",
          [](const LinearSystem& system, const ModeChain& chain, const Array& p,
             const std::optional<Array>& nominal) -> py::object {
            AnyLinearFilter out;
            const ConfigStatus status = AnyLinearFilter::make(
                system, chain, matrices(p), nominal ? matrix(*nominal) : Eigen::MatrixXd(), out);
            return status == ConfigStatus::ok ? py::cast(out) : py::object(py::str(name(status)));
          },
          py::arg("system"), py::arg("chain"), py::arg("p"), py::arg("nominal"))
      .def("run", &run<AnyLinearFilter>, py::arg("z").noconvert(), py::arg("modes"), py::arg("n"),
           py::arg("M"), py::arg("threads"));
}

}  // namespace surefix::bindings
