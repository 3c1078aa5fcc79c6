// Arrays between NumPy and the engine. No mathematics here.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace surefix::bindings {

namespace py = pybind11;

/// float64, C order; converted if it is not (the Python face has checked shapes and names).
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using IntArray = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

/// The column of factors of a log of `rows`, null without one.
inline const double* factors(const std::optional<Array>& factor, py::ssize_t rows) {
  if (!factor) return nullptr;
  if (factor->ndim() != 1 || factor->shape(0) != rows)
    throw std::invalid_argument("factor: expected one for every row");
  return factor->data();
}

inline Eigen::MatrixXd matrix(const Array& array) {
  if (array.ndim() != 2) throw std::invalid_argument("expected a matrix");
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(array.data(), array.shape(0), array.shape(1));
}

inline Eigen::VectorXd vector(const Array& array) {
  if (array.ndim() != 1) throw std::invalid_argument("expected a vector");
  return Eigen::Map<const Eigen::VectorXd>(array.data(), array.shape(0));
}

/// (k, rows, columns) as k matrices.
inline std::vector<Eigen::MatrixXd> matrices(const Array& array) {
  if (array.ndim() != 3) throw std::invalid_argument("expected matrices of all steps");
  std::vector<Eigen::MatrixXd> out;
  for (py::ssize_t k = 0; k < array.shape(0); ++k) {
    out.emplace_back(array.shape(1), array.shape(2));
    for (py::ssize_t i = 0; i < array.shape(1); ++i)
      for (py::ssize_t j = 0; j < array.shape(2); ++j) out.back()(i, j) = array.at(k, i, j);
  }
  return out;
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

/// The memory of the outputs that died last, kept for the next call: blocks of megabytes that go
/// back to the operating system are paid for again, page by page, when they are next asked for.
/// One block of at most 64 MiB; taken and given with the GIL held.
class SpareMemory {
 public:
  static std::size_t* take(std::size_t bytes) {
    std::size_t* found = std::exchange(spare_, nullptr);
    if (found != nullptr && *found >= bytes && *found / 4 <= bytes) return found;
    ::operator delete(found);
    found = static_cast<std::size_t*>(::operator new(header + bytes));
    *found = bytes;
    return found;
  }
  static void give(void* block) {
    auto* given = static_cast<std::size_t*>(block);
    if (*given <= largest) std::swap(given, spare_);
    ::operator delete(given);
  }
  static constexpr std::size_t header = 64;  // holds the block's size, keeps the alignment

 private:
  static constexpr std::size_t largest = 64 << 20;
  static inline std::size_t* spare_ = nullptr;
};

/// Arrays that are born and die together, out of one allocation.
class Block {
 public:
  explicit Block(py::ssize_t bytes)
      : memory_(SpareMemory::take(static_cast<std::size_t>(bytes) + 64)),
        owner_(memory_, &SpareMemory::give) {}

  template <class T>
  py::array_t<T> take(std::vector<py::ssize_t> shape) {
    py::ssize_t count = 1;
    for (const py::ssize_t length : shape) count *= length;
    used_ = (used_ + 7) / 8 * 8;
    auto* data = reinterpret_cast<unsigned char*>(memory_) + SpareMemory::header + used_;
    used_ += count * static_cast<py::ssize_t>(sizeof(T));
    return py::array_t<T>(std::move(shape), reinterpret_cast<T*>(data), owner_);
  }

 private:
  std::size_t* memory_;
  py::capsule owner_;
  py::ssize_t used_ = 0;
};

void bind_core(py::module_& module);
void bind_desync(py::module_& module);
void bind_drift(py::module_& module);
void bind_raim(py::module_& module);
void bind_robust(py::module_& module);
void bind_switching(py::module_& module);

}  // namespace surefix::bindings
