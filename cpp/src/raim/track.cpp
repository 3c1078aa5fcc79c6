#include "surefix/raim/track.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "smoothing_spline.hpp"

namespace surefix::raim {
namespace {

double length(const Point& a) noexcept { return std::sqrt(dot(a, a)); }
Point minus(const Point& a, const Point& b) noexcept {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

}  // namespace

ConfigStatus Track::make(const Eigen::MatrixXd& points, double tolerance, double start,
                         Track& out) {
  if (points.rows() < 2 || points.cols() != 3) return ConfigStatus::wrong_size;
  Eigen::VectorXd mileage(points.rows());
  mileage(0) = start;
  for (Eigen::Index i = 1; i < points.rows(); ++i)
    mileage(i) = mileage(i - 1) + (points.row(i) - points.row(i - 1)).norm();
  return make(points, mileage, tolerance, out);
}

ConfigStatus Track::make(const Eigen::MatrixXd& points, const Eigen::VectorXd& mileage,
                         double tolerance, Track& out) {
  const Eigen::Index k = points.rows();
  if (k < 2 || points.cols() != 3 || mileage.size() != k) return ConfigStatus::wrong_size;
  if (!points.allFinite() || !mileage.allFinite() || !std::isfinite(tolerance))
    return ConfigStatus::not_finite;
  if (tolerance < 0.0) return ConfigStatus::negative;
  for (Eigen::Index i = 1; i < k; ++i)
    if (!(mileage(i) > mileage(i - 1))) return ConfigStatus::not_positive;

  Track track;
  track.set(points, mileage, 0.0);
  if (tolerance > 0.0 && k > 2) {
    // The error grows with the stiffness, from nothing to that of a straight line: by bisection of
    // its logarithm, the largest that is within the tolerance.
    const double span = mileage(k - 1) - mileage(0);
    double low = std::log(span) * 4.0 - 80.0, high = std::log(span) * 4.0 + 10.0;
    track.set(points, mileage, std::exp(high));
    if (track.error_ <= tolerance) low = high;
    for (int i = 0; i < 40 && low < high; ++i) {
      const double middle = 0.5 * (low + high);
      track.set(points, mileage, std::exp(middle));
      (track.error_ <= tolerance ? low : high) = middle;
      if (high - low < 1e-3) break;
    }
    track.set(points, mileage, std::exp(low));
    if (track.error_ > tolerance) track.set(points, mileage, 0.0);
  }
  out = std::move(track);
  return ConfigStatus::ok;
}

void Track::set(const Eigen::MatrixXd& points, const Eigen::VectorXd& mileage, double stiffness) {
  const Spline spline = smoothing_spline(mileage, points, stiffness);
  knots_.resize(static_cast<std::size_t>(points.rows()));
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    Knot& knot = knots_[static_cast<std::size_t>(i)];
    knot.mileage = mileage(i);
    for (int j = 0; j < 3; ++j) {
      knot.position[static_cast<std::size_t>(j)] = spline.value(i, j);
      knot.bend[static_cast<std::size_t>(j)] = spline.bend(i, j);
    }
    knot.bending = length(knot.bend);
  }
  measure(points);
}

void Track::measure(const Eigen::MatrixXd& points) {
  error_ = edge_error_ = stretch_ = 0.0;
  double last = 0.0;
  for (std::size_t i = 0; i < knots_.size(); ++i) {
    const auto r = static_cast<Eigen::Index>(i);
    const double off =
        length(minus(knots_[i].position, {points(r, 0), points(r, 1), points(r, 2)}));
    error_ = std::max(error_, off);
    if (i > 0) {  // a function is within sup |f''| h²/8 of its chord
      const double h = knots_[i].mileage - knots_[i - 1].mileage;
      const double bend = std::max(knots_[i].bending, knots_[i - 1].bending);
      edge_error_ = std::max(edge_error_, std::max(off, last) + bend * h * h / 8.0);
      const double middle = 0.5 * (knots_[i].mileage + knots_[i - 1].mileage);
      stretch_ = std::max(stretch_, length(in_piece(i - 1, middle).tangent) + 0.5 * bend * h);
    }
    last = off;
  }
}

std::size_t Track::piece(double l) const noexcept {
  std::size_t first = 0;  // of `count` pieces that may be it; no branch that could be mispredicted
  for (std::size_t count = knots_.size() - 1; count > 1;) {
    const std::size_t half = count / 2;
    first += knots_[first + half].mileage <= l ? half : 0;
    count -= half;
  }
  return first;
}

TrackPoint Track::in_piece(std::size_t i, double l) const noexcept {
  const Knot &a = knots_[i], &b = knots_[i + 1];
  const double h = b.mileage - a.mileage, t = l - a.mileage, inside = std::clamp(t, 0.0, h);
  const double u = inside / h, v = 1.0 - u, beyond = t - inside;
  TrackPoint out;
  for (std::size_t j = 0; j < 3; ++j) {
    const double chord = (b.position[j] - a.position[j]) / h;
    out.tangent[j] =
        chord + h / 6.0 * ((3.0 * u * u - 1.0) * b.bend[j] - (3.0 * v * v - 1.0) * a.bend[j]);
    // From the nearer end, with what the bends add to the chord.
    out.position[j] = a.position[j] + u * (b.position[j] - a.position[j]) -
                      h * h / 6.0 * u * v * ((1.0 + v) * a.bend[j] + (1.0 + u) * b.bend[j]) +
                      beyond * out.tangent[j];
    out.bend[j] = beyond == 0.0 ? v * a.bend[j] + u * b.bend[j] : 0.0;
  }
  return out;
}

TrackPoint Track::at(double l) const noexcept { return in_piece(piece(l), l); }

double Track::bend_bound(double low, double high) const noexcept {
  double most = 0.0;
  each_piece(low, high, [&](std::size_t i) {
    most = std::max({most, knots_[i].bending, knots_[i + 1].bending});
  });
  return most;
}

double Track::curvature_bound(double low, double high) const noexcept {
  double most = 0.0;
  each_piece(low, high, [&](std::size_t i) {
    const Knot &a = knots_[i], &b = knots_[i + 1];
    const double bend = std::max(a.bending, b.bending), h = b.mileage - a.mileage;
    const double slowest =
        length(in_piece(i, 0.5 * (a.mileage + b.mileage)).tangent) - 0.5 * h * bend;
    const double infinity = std::numeric_limits<double>::infinity();
    if (bend > 0.0) most = std::max(most, slowest > 0.0 ? bend / (slowest * slowest) : infinity);
  });
  return most;
}

double Track::nearest(const Point& position) const noexcept {
  double best = knots_.front().mileage, least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < knots_.size(); ++i) {
    const Knot &a = knots_[i], &b = knots_[i + 1];
    const Point chord = minus(b.position, a.position), to = minus(position, a.position);
    const double square = dot(chord, chord);
    const double share = square > 0.0 ? std::clamp(dot(to, chord) / square, 0.0, 1.0) : 0.0;
    double l = a.mileage + share * (b.mileage - a.mileage);
    // Farther than what the arc can stand off its chord: not this piece.
    const double h = b.mileage - a.mileage;
    const double stand_off = std::max(a.bending, b.bending) * h * h / 8.0;
    Point off = minus(to, {share * chord[0], share * chord[1], share * chord[2]});
    if (length(off) - stand_off > least) continue;
    for (int step = 0; step < 8; ++step) {  // Newton on (position − c)·c' = 0
      const TrackPoint at = in_piece(i, l);
      off = minus(position, at.position);
      const double slope = dot(at.tangent, at.tangent) - dot(off, at.bend);
      if (!(slope > 0.0)) break;
      const double next = std::clamp(l + dot(off, at.tangent) / slope, a.mileage, b.mileage);
      if (next == l) break;
      l = next;
    }
    const double distance = length(minus(position, in_piece(i, l).position));
    if (distance < least) least = distance, best = l;
  }
  for (const double end : {low(), high()}) {  // beyond the ends it is straight
    const TrackPoint at = in_piece(piece(end), end);
    const Point off = minus(position, at.position);
    const double l = end + dot(off, at.tangent) / dot(at.tangent, at.tangent);
    if (end == low() ? l >= end : l <= end) continue;
    const double distance = length(minus(position, this->at(l).position));
    if (distance < least) least = distance, best = l;
  }
  return best;
}

}  // namespace surefix::raim
