// Measurements that wait in a filter, as (validity, sensor, value, id, factor), each a list.
#pragma once

#include <pybind11/stl.h>

#include <stdexcept>
#include <tuple>
#include <vector>

#include "surefix/desync/measurement.hpp"

namespace surefix::bindings {

namespace py = pybind11;

inline py::tuple pack(const std::vector<desync::Measurement>& waiting) {
  py::list valid, sensor, value, id, factor;
  for (const desync::Measurement& m : waiting) {
    valid.append(m.valid);
    sensor.append(m.sensor);
    value.append(m.value);
    id.append(m.id);
    factor.append(m.factor);
  }
  return py::make_tuple(valid, sensor, value, id, factor);
}

inline std::vector<desync::Measurement> unpack(const py::handle& in) {
  const auto [valid, sensor, value, id, factor] =
      in.cast<std::tuple<std::vector<Time>, std::vector<std::int32_t>, std::vector<double>,
                         std::vector<std::int64_t>, std::vector<double>>>();
  if (sensor.size() != valid.size() || value.size() != valid.size() || id.size() != valid.size() ||
      factor.size() != valid.size())
    throw std::invalid_argument("waiting: expected lists of one length");
  std::vector<desync::Measurement> out;
  for (std::size_t i = 0; i < valid.size(); ++i)
    out.push_back({valid[i], value[i], id[i], sensor[i], factor[i]});
  return out;
}

}  // namespace surefix::bindings
