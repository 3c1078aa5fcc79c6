// Any satellites on any track: a number only where one is claimed, and then a number.
#include <cmath>
#include <vector>

#include "bytes.hpp"
#include "surefix/raim/follower.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace surefix;
  using fuzz::require;
  fuzz::Bytes bytes(data, size);
  Eigen::MatrixXd points(2 + bytes.byte() % 6, 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      points(i, j) = bytes.number(j == 0 ? 100.0 * double(i) : 0.0, 50.0);
  raim::Track track;
  if (raim::Track::make(points, bytes.byte() % 2 == 0 ? 0.0 : 5.0, 0.0, track) != ConfigStatus::ok)
    return 0;
  raim::MonitorSettings settings;
  settings.max_faults = bytes.byte() % 3;
  settings.max_excluded = bytes.byte() % 5;
  settings.rotation = bytes.byte() % 2 == 0 ? 0.0 : raim::earth_rotation;
  settings.fault_probability = 1e-5;
  const raim::TrackRaim monitor(track, settings);
  const bool known = bytes.byte() % 2 == 0;
  raim::Follower follower(monitor, known ? 30.0 : std::numeric_limits<double>::infinity(),
                          known ? 50.0 : raim::Verdict::none);
  double time = 0.0;
  bool first = true;  // which may be at any time
  std::int64_t refused = 0;
  while (bytes.more()) {
    std::vector<raim::Satellite> sky(bytes.byte() % 12);
    for (std::size_t i = 0; i < sky.size(); ++i) {
      const double angle = 0.7 * double(i), high = 0.3 + 0.1 * double(i);
      sky[i].position = {bytes.number(2.2e7 * std::cos(angle) * std::cos(high), 1e5),
                         bytes.number(2.2e7 * std::sin(angle) * std::cos(high), 1e5),
                         bytes.number(2.2e7 * std::sin(high), 1e5)};
      sky[i].sigma = std::abs(bytes.number(5.0, 1.0));
      sky[i].system = bytes.byte() % 3 - (bytes.byte() == 0);
      raim::TrackPoint at = track.at(40.0);
      sky[i].pseudorange =
          raim::look(at, sky[i].position, settings.rotation).range + bytes.number(0.0, 20.0);
    }
    const double now = time + bytes.number(1.0, 2.0);
    const bool forwards = std::isfinite(now) && (first || now >= time);
    if (forwards) time = now, first = false;
    refused += !forwards;
    const double low = follower.low(), high = follower.high();
    const raim::Verdict v = follower.judge(now, sky.data(), static_cast<int>(sky.size()));
    require(forwards == (v.status != raim::Solvable::time), "a time that is one");
    require(follower.refused() == refused, "epochs refused are counted");
    require(forwards || (follower.low() == low && follower.high() == high), "and change nothing");
    const bool usable = v.declared == raim::Declared::ok || v.declared == raim::Declared::excluded;
    require(!usable || (std::isfinite(v.along) && v.sigma > 0.0), "a position");
    require(!usable || !(v.protection <= 0.0), "a level is positive");
    require(!usable || settings.max_faults == 0 || !std::isnan(v.protection), "there is a level");
    require(v.declared != raim::Declared::not_available || std::isnan(v.along), "no number");
    require(!(v.p_star < 0.0 || v.p_star > 1.0), "a probability");
  }
  return 0;
}
