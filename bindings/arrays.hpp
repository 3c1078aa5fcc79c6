// Arrays between NumPy and the engine. No mathematics here.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <stdexcept>
#include <string>
#include <vector>

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

/// Arrays that are born and die together, out of one allocation: blocks of several megabytes that
/// are freed one by one go back to the operating system and are paid for again, page by page, in
/// the next call.
class Block {
 public:
  explicit Block(py::ssize_t bytes) : memory_(bytes + 64) {}

  template <class T>
  py::array_t<T> take(std::vector<py::ssize_t> shape) {
    py::ssize_t count = 1;
    for (const py::ssize_t length : shape) count *= length;
    used_ = (used_ + 7) / 8 * 8;
    auto* first = reinterpret_cast<T*>(memory_.mutable_data() + used_);
    used_ += count * static_cast<py::ssize_t>(sizeof(T));
    return py::array_t<T>(std::move(shape), first, memory_);
  }

 private:
  py::array_t<std::uint8_t> memory_;
  py::ssize_t used_ = 0;
};

void bind_core(py::module_& module);
void bind_desync(py::module_& module);

}  // namespace surefix::bindings
