// Arrays between NumPy and the engine. No mathematics here.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <stdexcept>
#include <string>

namespace surefix::bindings {

namespace py = pybind11;

/// float64, C order; converted if it is not (the Python face has checked shapes and names).
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using IntArray = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

inline Eigen::MatrixXd matrix(const Array& array) {
  if (array.ndim() != 2) throw std::invalid_argument("expected a matrix");
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(array.data(), array.shape(0), array.shape(1));
}

inline Eigen::VectorXd vector(const Array& array) {
  if (array.ndim() != 1) throw std::invalid_argument("expected a vector");
  return Eigen::Map<const Eigen::VectorXd>(array.data(), array.shape(0));
}

template <class Derived>
Array to_numpy(const Eigen::MatrixBase<Derived>& value) {
  if (Derived::ColsAtCompileTime == 1) {
    Array out(value.rows());
    for (Eigen::Index i = 0; i < value.rows(); ++i) out.mutable_at(i) = value(i, 0);
    return out;
  }
  Array out({value.rows(), value.cols()});
  for (Eigen::Index i = 0; i < value.rows(); ++i)
    for (Eigen::Index j = 0; j < value.cols(); ++j) out.mutable_at(i, j) = value(i, j);
  return out;
}

void bind_core(py::module_& module);
void bind_desync(py::module_& module);

}  // namespace surefix::bindings
