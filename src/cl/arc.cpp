#include "trunnion/cl/arc.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion::cl {

namespace {

Vec3 radial(const Arc& arc, const Vec3& point_P) {
  const Vec3 from_center = point_P - arc.center_P;
  return from_center - arc.normal_P * arc.normal_P.dot(from_center);
}

}  // namespace

Vec3 point_on(const Arc& arc, double t) {
  const Vec3 start = radial(arc, arc.start_P);
  const double start_radius = start.norm();
  const double radius = start_radius + t * (radial(arc, arc.end_P).norm() - start_radius);
  const double start_height = arc.normal_P.dot(arc.start_P - arc.center_P);
  const double height = start_height + t * (arc.normal_P.dot(arc.end_P - arc.center_P) - start_height);
  const Vec3 turned = rotation_about(arc.normal_P, arc.sweep * t) * (start / start_radius);
  return arc.center_P + turned * radius + arc.normal_P * height;
}

double chords_of(const Arc& arc, double tolerance_mm) {
  TRUNNION_EXPECTS(tolerance_mm > 0.0);
  TRUNNION_EXPECTS(arc.sweep.rad() > 0.0);
  const double radius = std::max(radial(arc, arc.start_P).norm(), radial(arc, arc.end_P).norm());
  // From the half-angle sine, which keeps its digits where the cosine is near 1: r (1 - cos(d/2)) = 2 r
  // sin^2(d/4).
  const double step = 4.0 * std::asin(std::sqrt(std::min(0.5, tolerance_mm / (2.0 * radius))));
  // At least four chords a turn: with fewer, the middle of a chord says nothing of the sense.
  const double largest_step = std::min(step, kTwoPi / 4.0);
  return std::max(1.0, std::ceil(arc.sweep.rad() / largest_step - 1e-9));
}

std::vector<Vec3> linearise(const Arc& arc, double tolerance_mm) {
  const auto count = static_cast<std::size_t>(chords_of(arc, tolerance_mm));
  std::vector<Vec3> points;
  points.reserve(count);
  for (std::size_t i = 1; i < count; ++i) {
    points.push_back(point_on(arc, static_cast<double>(i) / static_cast<double>(count)));
  }
  points.push_back(arc.end_P);
  return points;
}

}  // namespace trunnion::cl
