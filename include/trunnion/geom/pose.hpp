#pragma once
#include "trunnion/base/units.hpp"
#include "trunnion/geom/vec.hpp"

namespace trunnion {

/// Rotation matrix of a turn by `angle` about the unit vector `axis`, right-hand rule (Rodrigues).
/// Multiples of 90 degrees given as Angle::degrees are exact to the last bit of sine and cosine of the
/// double.
Mat3 rotation_about(const Vec3& axis, Angle angle);

/// Pose of a frame B in a frame A: `p_A = R * p_B + p`. Written X_AB; the only legal product is X_AB * X_BC.
struct Pose {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();

  static Pose identity() { return {}; }
  static Pose translation(const Vec3& offset_mm) { return {Mat3::Identity(), offset_mm}; }
  /// A turn about the line through `point` along the unit vector `axis`.
  static Pose rotation(const Vec3& axis, const Vec3& point, Angle angle);

  Pose operator*(const Pose& X_BC) const { return {R * X_BC.R, R * X_BC.p + p}; }
  /// The point `p_B` in A.
  Vec3 operator*(const Vec3& p_B) const { return R * p_B + p; }
  Pose inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
};

/// A small displacement: rotation vector `rot_rad` (applied about the origin of the frame in which it stands)
/// and translation `trans_mm`, both in the axes of that frame. Twists at one joint add (physics: first
/// order); between joints the poses that `exp` makes of them are composed exactly.
struct Twist {
  Vec3 trans_mm = Vec3::Zero();
  Vec3 rot_rad = Vec3::Zero();

  Twist operator+(const Twist& o) const { return {trans_mm + o.trans_mm, rot_rad + o.rot_rad}; }
  Twist operator-(const Twist& o) const { return {trans_mm - o.trans_mm, rot_rad - o.rot_rad}; }
  Twist operator*(double factor) const { return {trans_mm * factor, rot_rad * factor}; }
  Twist& operator+=(const Twist& o) { return *this = *this + o; }
  bool is_zero() const { return trans_mm.isZero(0.0) && rot_rad.isZero(0.0); }
};

/// Exponential of the twist in SE(3): the pose reached by moving with it for unit time.
Pose exp(const Twist& twist);

/// Rotation vector of a rotation matrix (angle in [0, pi]); exact to rounding for small angles.
Vec3 rotation_vector(const Mat3& R);

/// Angle between two directions (any length but zero), by atan2(|a x b|, a . b): accurate near 0 and pi.
Angle angle_between(const Vec3& a, const Vec3& b);

/// To a point from the nearest one of the segment from `a` to `b` (which may have zero length), mm.
Vec3 from_segment(const Vec3& point, const Vec3& a, const Vec3& b);
/// Distance of a point from that segment, mm.
double distance_to_segment(const Vec3& point, const Vec3& a, const Vec3& b);

/// Point of the great circle from unit vector u0 to u1 at fraction t in [0, 1]. Antipodal vectors have no
/// great circle: u0 is kept for t < 1/2, u1 after.
Vec3 slerp(const Vec3& u0, const Vec3& u1, double t);

}  // namespace trunnion
