// A log as the columns that a batch reads, and the columns that it writes.
#pragma once

#include <limits>
#include <vector>

#include "surefix/desync/batch.hpp"
#include "systems.hpp"

namespace surefix::test {

struct Columns {
  template <class System>
  Columns(const System& system, const std::vector<Row>& log, std::size_t estimates)
      : n(static_cast<std::size_t>(system.state_size())) {
    for (const Row& row : log) {
      stamp.push_back(row.stamp);
      sensor.push_back(row.sensor);
      value.push_back(row.value);
    }
    const std::size_t N = log.size();
    time.resize(estimates);
    x.resize(estimates * n);
    P.resize(estimates * n * n);
    sse.resize(estimates);
    degrees.resize(estimates);
    status.resize(N);
    noise.assign(N, std::numeric_limits<double>::quiet_NaN());
    noise_variance = noise;
  }
  desync::LogView view() const { return {stamp.data(), sensor.data(), value.data(), stamp.size()}; }
  desync::BatchOutput output() {
    return {time.data(),    x.data(),      P.data(),     sse.data(),
            degrees.data(), status.data(), noise.data(), noise_variance.data()};
  }
  Eigen::VectorXd mean(std::size_t t) const {
    return Eigen::Map<const Eigen::VectorXd>(x.data() + t * n, static_cast<Eigen::Index>(n));
  }
  Eigen::MatrixXd covariance(std::size_t t) const {
    const auto size = static_cast<Eigen::Index>(n);
    return Eigen::Map<const Eigen::MatrixXd>(P.data() + t * n * n, size, size);
  }

  std::size_t n;
  std::vector<Time> stamp;
  std::vector<std::int32_t> sensor;
  std::vector<double> value;
  std::vector<double> time;
  std::vector<double> x, P, sse;
  std::vector<std::int32_t> degrees;
  std::vector<Status> status;
  std::vector<double> noise, noise_variance;
};

}  // namespace surefix::test
