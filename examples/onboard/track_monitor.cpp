// Where a train is on its line, from pseudoranges, and how far off that may be: RAIM along a track
// (Lacresse, Grall & Nikiforov 2005), with protection levels and exclusion.
//
//   T,x,y,z [m]         the line's vertices, before anything else
//   S,x,y,z [m],pseudorange [m],sigma [m],system      a satellite of the epoch that comes
//   E,time [s]          the epoch is complete
//
// writes time, what is declared, the position along the line, its protection level [m], and how
// many satellites were used and taken out.
#include <surefix/raim/follower.hpp>
#include <surefix/version.hpp>
#include <vector>

#include "lines.hpp"

namespace {

using surefix::ConfigStatus;
using namespace surefix::raim;

constexpr double max_speed = 90.0;  // [m/s]

[[nodiscard]] bool make_track(const std::vector<Point>& vertices, Track& track) {
  Eigen::MatrixXd points(static_cast<Eigen::Index>(vertices.size()), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      points(i, j) = vertices[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  return Track::make(points, 0.0, 0.0, track) == ConfigStatus::ok;
}

}  // namespace

int main() {
  if (!surefix::fits_library()) return refused("a library that is not the headers'");
  static Lines lines;
  std::vector<Point> vertices;
  bool more = lines.next();
  for (; more && lines.is('T', 3); more = lines.next()) {
    vertices.push_back({lines.number(0), lines.number(1), lines.number(2)});
    if (lines.bad()) return refused("a vertex of the track");
  }
  MonitorSettings settings;
  settings.length = 50.0;
  Track track;
  if (settings.check() != ConfigStatus::ok) return refused("settings");
  if (!make_track(vertices, track)) return refused("the track: two vertices or more, all finite");
  static const TrackRaim monitor(track, settings);
  Follower follower(monitor, max_speed, Verdict::none);  // where it begins is not known
  // From here on nothing allocates.
  std::array<Satellite, max_satellites> sky;
  int n = 0;
  long long bad = 0;
  for (; more; more = lines.next()) {
    const bool seen = lines.is('S', 6), complete = lines.is('E', 1);
    if (seen) {
      const Satellite satellite{{lines.number(0), lines.number(1), lines.number(2)},
                                lines.number(3),
                                lines.number(4),
                                lines.whole<int>(5)};
      // A line that is broken is a satellite that cannot be read: the epoch is judged without it.
      // One too many is counted, and the monitor says so.
      if (!lines.bad() && n++ < max_satellites) sky[static_cast<std::size_t>(n - 1)] = satellite;
    } else if (complete) {
      const Verdict verdict = follower.judge(lines.number(0), sky.data(), n);
      std::printf("%.1f,%s,%.2f,%.2f,%d,%d\n", lines.number(0), name(verdict.declared),
                  verdict.along, verdict.protection, verdict.used, verdict.excluded);
      n = 0;
    }
    bad += lines.bad() || !(seen || complete);
  }
  if (bad > 0) std::printf("bad_line,%lld\n", bad);
  if (follower.refused() > 0)
    std::printf("bad_time,%lld\n", static_cast<long long>(follower.refused()));
  return Lines::finish();
}
