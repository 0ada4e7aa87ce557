#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/vec.hpp"

namespace trunnion::path {

/// Largest value on [0, 1] of a (1 - t) + b t + 4 c t (1 - t), c >= 0.
inline double largest_bowed(double a, double b, double c) {
  const double slope = b - a;
  if (std::abs(slope) >= 4.0 * c) return std::max(a, b);
  return 0.5 * (a + b) + c + slope * slope / (16.0 * c);
}

/// The second derivative of a polynomial curve around one parameter, and what it may change by within +-eta
/// of it.
struct Bend {
  Vec3 f2, f3, f4;  // at that parameter
  double eta = 0.0;
  /// Bound on |linear(x'')| over the part; `linear` gives the norm of a linear map of a vector.
  template <class Norm>
  double bound(Norm&& linear) const {
    return linear(f2) + eta * (linear(f3) + (0.5 * eta) * linear(f4));
  }
};

// Both shapes: `across` the distance from the line (plane) that carries the convex set, `over` how far the
// foot lies beyond each end. All are convex along a straight part, so a curve exceeds the larger of its ends
// by at most h^2/8 max|x''| in each.

/// Distance from the segment p0 p1 in space, mm.
class SegmentShape {
 public:
  SegmentShape(const Vec3& p0, const Vec3& p1) : p0_(p0) {
    const Vec3 chord = p1 - p0;
    length_ = chord.norm();
    e_ = length_ > 0.0 ? Vec3(chord / length_) : Vec3::Zero();
  }
  struct Foot {
    double across = 0.0;
    std::array<double, 2> over{};
  };
  Foot foot(const Vec3& x) const {
    const Vec3 v = x - p0_;
    const double along = v.dot(e_);
    return {(v - along * e_).norm(), {-along, along - length_}};
  }
  static double distance(const Foot& f) {
    return std::hypot(f.across, std::max({0.0, f.over[0], f.over[1]}));
  }
  /// Bound on the distance over a part of width h between the feet a and b.
  double part(const Foot& a, const Foot& b, double h, const Bend& bend) const {
    const double c = h * h / 8.0;
    const double along = c * bend.bound([this](const Vec3& v) { return std::abs(v.dot(e_)); });
    const double across = c * bend.bound([this](const Vec3& v) { return (v - v.dot(e_) * e_).norm(); });
    const double over = std::max(
        {0.0, largest_bowed(a.over[0], b.over[0], along), largest_bowed(a.over[1], b.over[1], along)});
    const double split = std::hypot(largest_bowed(a.across, b.across, across), over);
    if (over == 0.0) return split;
    return std::min(split, largest_bowed(distance(a), distance(b), std::hypot(along, across)));
  }
  static double measure(double distance) { return distance; }

 private:
  Vec3 p0_, e_;
  double length_ = 0.0;
};

/// Angle of a unit vector from the arc u0 u1, through the distance from the plane sector (a convex cone) that
/// the arc spans: that distance is the sine of the angle up to 90 degrees, and 1 beyond.
class ArcShape {
 public:
  ArcShape(const Vec3& u0, const Vec3& u1) : u0_(u0), u1_(u1) {
    n_ = u0.cross(u1 - u0);
    const double sine = n_.norm();
    // Ends that doubles cannot tell apart: any plane through u0 will do, the sector is then a ray.
    constexpr double kSameAxis = 1e-14;
    if (sine > kSameAxis) {
      n_ /= sine;
      t0_ = n_.cross(u0);
      t1_ = u1.cross(n_);
    } else {
      n_ = u0.cross(std::abs(u0.x()) < 0.5 ? Vec3::UnitX() : Vec3::UnitY()).normalized();
      t0_ = n_.cross(u0);
      t1_ = -t0_;
    }
  }
  struct Foot {
    double across = 0.0;
    std::array<double, 2> over{};
    std::array<double, 2> front{};  // component along each ray
  };
  Foot foot(const Vec3& x) const {
    // x - u0, not x: n is known to 1e-16 / |u1 - u0| only.
    return {std::abs(n_.dot(x - u0_)), {-t0_.dot(x), -t1_.dot(x)}, {u0_.dot(x), u1_.dot(x)}};
  }
  /// Distance from the arc's plane, with its sign.
  double beside(const Vec3& x) const { return n_.dot(x - u0_); }
  static double distance(const Foot& f) {
    if (f.over[0] <= 0.0 && f.over[1] <= 0.0) return f.across;
    // Beyond an end: the nearer ray, or the tip of the cone when both lie behind.
    double nearest = 1.0;
    for (std::size_t k = 0; k < 2; ++k) {
      if (f.front[k] > 0.0) nearest = std::min(nearest, std::hypot(f.across, f.over[k]));
    }
    return nearest;
  }
  double part(const Foot& a, const Foot& b, double h, const Bend& bend) const {
    const double c = h * h / 8.0;
    const double across = c * bend.bound([this](const Vec3& v) { return std::abs(v.dot(n_)); });
    const double side0 = c * bend.bound([this](const Vec3& v) { return std::abs(v.dot(t0_)); });
    const double side1 = c * bend.bound([this](const Vec3& v) { return std::abs(v.dot(t1_)); });
    const double over0 = largest_bowed(a.over[0], b.over[0], side0);
    const double over1 = largest_bowed(a.over[1], b.over[1], side1);
    const double over = std::max({0.0, over0, over1});
    const double split = std::hypot(largest_bowed(a.across, b.across, across), over);
    if (over == 0.0) return split;
    const double full = c * bend.bound([](const Vec3& v) { return v.norm(); });
    const double general = largest_bowed(distance(a), distance(b), full);
    // The split form needs the foot on the ray, not behind the tip of the cone.
    const bool before0 = over0 <= 0.0 || std::min(a.front[0], b.front[0]) > full;
    const bool before1 = over1 <= 0.0 || std::min(a.front[1], b.front[1]) > full;
    return before0 && before1 ? std::min(split, general) : general;
  }
  static double measure(double distance) { return distance < 1.0 ? std::asin(distance) : kPi; }

 private:
  Vec3 u0_, u1_, n_, t0_, t1_;
};

}  // namespace trunnion::path
