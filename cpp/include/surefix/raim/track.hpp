// A railway line or a road as a curve: position, direction and bend at every mileage, with bounds.
//
// The curve is a natural cubic spline over the polyline's mileage l, its cumulated chord length: a
// polyline's vertex keeps the mileage that its user knows. With a tolerance it is the smoothest
// curve (least ∫|c''|² dl, each vertex weighted with the length that it stands for) that stays
// within the tolerance of every vertex. Beyond its ends the track is straight.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "surefix/core/status.hpp"

namespace surefix::raim {

using Point = std::array<double, 3>;

[[nodiscard]] inline double dot(const Point& a, const Point& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// c(l), dc/dl and d²c/dl².
struct TrackPoint {
  Point position;  ///< [m]
  Point tangent;   ///< [1], of length near one
  Point bend;      ///< [1/m]
};

class Track {
 public:
  /// points (k × 3) [m], k ≥ 2, each apart from the one before; tolerance ≥ 0 [m]; `start`: the
  /// mileage of the first [m]. Allocates; nothing else does.
  [[nodiscard]] static ConfigStatus make(const Eigen::MatrixXd& points, double tolerance,
                                         double start, Track& out);
  /// The same over mileages (k) of the caller's, increasing: an analytic track keeps its parameter.
  [[nodiscard]] static ConfigStatus make(const Eigen::MatrixXd& points,
                                         const Eigen::VectorXd& mileage, double tolerance,
                                         Track& out);

  [[nodiscard]] double low() const noexcept { return knots_.front().mileage; }
  [[nodiscard]] double high() const noexcept { return knots_.back().mileage; }
  /// Largest distance of a vertex from the curve at the vertex's mileage [m].
  [[nodiscard]] double error() const noexcept { return error_; }
  /// Bound on the distance of the curve from the polyline at the same mileage, vertices and what
  /// lies between them [m].
  [[nodiscard]] double edge_error() const noexcept { return edge_error_; }

  [[nodiscard]] TrackPoint at(double l) const noexcept;
  /// Bound on ‖dc/dl‖ [1].
  [[nodiscard]] double stretch() const noexcept { return stretch_; }
  /// Bound on ‖d²c/dl²‖ over [low, high]: its largest on the pieces that this meets [1/m].
  [[nodiscard]] double bend_bound(double low, double high) const noexcept;
  /// Bound on the curvature ‖c' × c''‖/‖c'‖³ over [low, high], sup ‖c''‖ / (inf ‖c'‖)² piece by
  /// piece [1/m].
  [[nodiscard]] double curvature_bound(double low, double high) const noexcept;
  /// Mileage of the point of the curve, and of its straight continuations, nearest to `position`.
  [[nodiscard]] double nearest(const Point& position) const noexcept;

 private:
  struct Knot {
    double mileage;
    Point position;
    Point bend;      // linear in l between two knots
    double bending;  // its length
  };
  /// Index of the piece that holds l, the first or last one beyond the ends.
  [[nodiscard]] std::size_t piece(double l) const noexcept;
  /// Calls f(i) for every piece that [low, high] meets.
  template <class F>
  void each_piece(double low, double high, F&& f) const noexcept {
    for (std::size_t i = piece(low); i + 1 < knots_.size(); ++i) {
      f(i);
      if (knots_[i + 1].mileage >= high) break;
    }
  }
  [[nodiscard]] TrackPoint in_piece(std::size_t i, double l) const noexcept;
  void set(const Eigen::MatrixXd& points, const Eigen::VectorXd& mileage, double stiffness);
  void measure(const Eigen::MatrixXd& points);

  std::vector<Knot> knots_;
  double error_ = 0.0;
  double edge_error_ = 0.0;
  double stretch_ = 1.0;
};

}  // namespace surefix::raim
