// Replays of the inputs beside this file through each system, as CSV with every digit: what is
// committed as speed.csv, robust.csv, switching.csv, drift.csv and raim.csv.
#pragma once

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "robust/faults.hpp"
#include "surefix/drift/sliding_detector.hpp"
#include "surefix/raim/follower.hpp"
#include "switching/switching.hpp"

namespace surefix::golden {

using test::millisecond;
using test::second;

/// The rows of a CSV without its header, as numbers.
inline std::vector<std::vector<double>> read(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  std::string line, cell;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    while (std::getline(cells, cell, ','))
      rows.back().push_back(std::strtod(cell.c_str(), nullptr));
  }
  return rows;
}

/// Writes rows of a CSV; numbers with 17 digits, which is every bit.
class Table {
 public:
  explicit Table(const std::string& header) : text_(header) {}
  Table& row() {
    text_ += '\n';
    first_ = true;
    return *this;
  }
  template <class... T>
  Table& operator()(const T&... values) {
    (cell(values), ...);
    return *this;
  }
  [[nodiscard]] std::string text() const { return text_ + '\n'; }

 private:
  void cell(double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.17g", value);
    cell(std::isnan(value) ? "nan" : digits);  // not the sign of a NaN, which means nothing
  }
  void cell(int value) { cell(std::to_string(value).c_str()); }
  void cell(std::int64_t value) { cell(std::to_string(value).c_str()); }
  void cell(const char* value) {
    if (!first_) text_ += ',';
    text_ += value;
    first_ = false;
  }

  std::string text_;
  bool first_ = true;
};

/// Pushes the rows of log.csv in the order of their arrival and calls `estimate(tick)` every 0.5 s,
/// 0.2 s later; every answer is counted.
template <class Filter, class Estimate>
void journey(const std::string& folder, Filter& filter, Estimate&& estimate) {
  const auto rows = read(folder + "/log.csv");
  std::size_t next = 0;
  for (int step = 1; step <= 120; ++step) {
    const Time tick = step * 500 * millisecond;
    for (; next < rows.size(); ++next) {
      const auto& row = rows[next];
      if (row[0] > static_cast<double>(tick + 200 * millisecond)) break;
      (void)filter.push(static_cast<Time>(row[1]), static_cast<std::int32_t>(row[2]), row[3],
                        static_cast<std::int64_t>(next));
    }
    estimate(tick);
  }
}

inline void counts(Table& table, const Counters& counters) {
  table.row();
  for (const std::int64_t count : counters.all()) table(count);
}

inline std::string speed(const std::string& folder) {
  const SpeedSystem system = test::speed_system();
  desync::Filter<SpeedSystem, 64> filter(system, test::broad(system), 0);
  Table table("time,status,x0,x1,P00,P01,P11,sse,degrees,log_likelihood,noise,noise_variance");
  journey(folder, filter, [&](Time tick) {
    desync::StepError error{};
    const Status status = filter.estimate(tick, error);
    double noise = 0.0, variance = 0.0;  // of the step's measurements, summed
    filter.noise([&](std::size_t, const desync::NoiseEstimate& found) {
      noise += found.value;
      variance += found.variance;
    });
    const auto& belief = filter.state().belief;
    table.row()(tick, name(status), belief.x(0), belief.x(1), belief.P(0, 0), belief.P(0, 1),
                belief.P(1, 1), error.sse, error.degrees, filter.state().likelihood.value(), noise,
                variance);
  });
  counts(table, filter.counters());
  return table.text();
}

inline std::string robust(const std::string& folder) {
  const SpeedSystem system = test::speed_system();
  using Kind = surefix::robust::Carry::Kind;
  Table table(
      "carry,time,status,x0,x1,P00,P01,P11,lower,upper,discarded,sse,degrees,hypothesis,"
      "healthy0,outage0,drifting0,healthy1,outage1,drifting1,healthy2,outage2,drifting2");
  for (const Kind kind : {Kind::merge, Kind::one_gaussian}) {
    surefix::robust::Filter<surefix::robust::test::SpeedFaults, 64> filter(
        surefix::robust::test::speed_setup(kind, 27), test::broad(system), 0);
    journey(folder, filter, [&](Time tick) {
      surefix::robust::RobustEstimate e;
      const Status status = filter.estimate(tick, e);
      table.row()(kind == Kind::merge ? "merge" : "one", tick, name(status), e.x[0], e.x[1], e.P[0],
                  e.P[1], e.P[3], e.lower, e.upper, e.discarded, e.sse, static_cast<int>(e.degrees),
                  e.hypothesis);
      for (int s = 0; s < 3; ++s)
        for (int m = 0; m < 3; ++m)
          table(e.mode_probability[s * surefix::robust::SensorModes::max_modes + m]);
    });
    counts(table, filter.counters());
  }
  return table.text();
}

template <switching::Method method>
void interrupted(const std::string& folder, const char* label, Table& table) {
  const switching::testing::Prepared prepared;
  switching::Filter<method, switching::testing::Two> filter;
  if (filter.make(switching::testing::four_modes(), prepared.system.initial()) != ConfigStatus::ok)
    return;
  for (const auto& row : read(folder + "/measurements.csv")) {
    switching::Measured<switching::testing::Two> z;
    z(0) = row[1];
    const Status status = filter.step(prepared.transition(), prepared.observation(), z);
    const auto& found = filter.estimate();
    table.row()(label, static_cast<int>(row[0]), name(status), found.x(0), found.x(1),
                found.P(0, 0), found.P(0, 1), found.P(1, 1), filter.mode(0), filter.mode(1),
                filter.mode(2), filter.mode(3), filter.log_likelihood());
  }
}

inline std::string switching(const std::string& folder) {
  Table table("method,k,status,x0,x1,P00,P01,P11,mode0,mode1,mode2,mode3,log_likelihood");
  interrupted<switching::Method::imm>(folder, "imm", table);
  interrupted<switching::Method::one_step>(folder, "one-step", table);
  return table.text();
}

inline std::string drift(const std::string& folder) {
  using surefix::drift::Finding;
  using surefix::drift::Profile;
  const SpeedSystem system = test::speed_system();
  desync::Filter<SpeedSystem, 64> filter(system, test::broad(system), 0);
  surefix::drift::SlidingDetector<SpeedSystem, 60> detector(system);
  Profile::Matrix A(2, 2), onset(2, 1);
  A << 0.0, 1.0, 0.0, 0.0;
  onset << 0.0, 1.0;
  Profile ramp;
  if (Profile::make(A, Eigen::Vector2d(1.0, 0.0), onset, ramp) != ConfigStatus::ok) return {};
  for (const auto& direction : {std::array<double, 2>{1.0, 0.0}, std::array<double, 2>{0.0, 1.0}})
    if (detector.add(ramp, {direction[0], direction[1]}, 1e-3) != ConfigStatus::ok) return {};
  Table table("time,search,finding,onset,drop,p_bound,amplitude,deviation,onsets");
  journey(folder, filter, [&](Time tick) {
    desync::StepError error{};
    if (filter.estimate(tick, error) != Status::ok) return;
    detector.take(filter);
    for (int search = 0; search < 2; ++search) {
      const auto found = detector.look(search);
      const bool known = found.finding != Finding::undetectable;
      const double none = std::numeric_limits<double>::quiet_NaN();
      table.row()(tick, search, static_cast<int>(found.finding), found.onset, found.drop,
                  found.p_bound, known ? found.amplitude(0) : none,
                  known ? found.deviation(0) : none, static_cast<int>(found.onsets));
    }
  });
  return table.text();
}

inline std::string raim(const std::string& folder) {
  const auto vertices = read(folder + "/track.csv");
  Eigen::MatrixXd points(static_cast<Eigen::Index>(vertices.size()), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      points(i, j) = vertices[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  surefix::raim::Track track;
  if (surefix::raim::Track::make(points, 0.0, 0.0, track) != ConfigStatus::ok) return {};
  const surefix::raim::TrackRaim monitor(track, {});
  surefix::raim::Follower follower(monitor, 30.0, 50.0);
  const auto rows = read(folder + "/epochs.csv");
  Table table(
      "epoch,status,declared,used,excluded,along,sigma,clock0,clock1,statistic,degrees,"
      "threshold,alarm,separation_alarm,rival,p_star,bound,bound_along,e1,e2,"
      "snapshot_protection,protection,taken_out,v0,v1,v2,v3,v4,v5,v6,v7,v8,v9");
  for (std::size_t first = 0; first < rows.size(); first += 10) {
    std::array<surefix::raim::Satellite, 10> sky;
    for (std::size_t i = 0; i < 10; ++i) {
      const auto& r = rows[first + i];
      sky[i] = {{r[2], r[3], r[4]}, r[5], r[6], static_cast<int>(r[7])};
    }
    const auto v = follower.judge(rows[first][0], sky.data(), 10);
    int out = 0;
    for (std::size_t i = 0; i < 10; ++i) out |= v.taken_out[i] ? 1 << i : 0;
    table.row()(static_cast<int>(rows[first][0]), name(v.status), name(v.declared), v.used,
                v.excluded, v.along, v.sigma, v.clock[0], v.clock[1], v.statistic, v.degrees,
                v.threshold, static_cast<int>(v.alarm), static_cast<int>(v.separation_alarm),
                v.rival, v.p_star, v.bound, v.bound_along, v.e1, v.e2, v.snapshot_protection,
                v.protection, out);
    for (std::size_t i = 0; i < 10; ++i) table(v.critical_bias[i]);
  }
  return table.text();
}

}  // namespace surefix::golden
