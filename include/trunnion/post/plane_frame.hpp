#pragma once
#include <array>

#include "trunnion/geom/pose.hpp"
#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::post {

/// Axes of a tilted plane in P (its columns; Z is the tool axis) for the three angles of a control, rad:
///
///     euler_zxz   R = Rz(a) Rx(b) Rz(c)     about Z, the new X, the new Z
///     euler_xyz   R = Rx(a) Ry(b) Rz(c)     about X, the new Y, the new Z
///     fixed_xyz   R = Rz(c) Ry(b) Rx(a)     about the fixed X, then Y, then Z
Mat3 plane_axes(nc::PlaneAngles convention, const std::array<double, 3>& angles_rad);

/// Angles that give these axes, the inverse of `plane_axes`; in (-pi, pi]. Where two of them are about one
/// line (b = 0 for euler_zxz, b = 90 deg for the others) c is 0.
std::array<double, 3> plane_angles(nc::PlaneAngles convention, const Mat3& axes_P);

/// A tilted plane as the control knows it.
struct PlaneFrame {
  Pose X_PF;  // its frame in P, from the rounded words

  /// The block that switches it on, with origin and angles rounded to the control's words; `X_PF` is what the
  /// rounded words mean. The control counts the origin from the active work offset: `zero` is the zero of P
  /// there, the rotary axes at 0, mm.
  static PlaneFrame of(const nc::Controller& controller, const Pose& X_PF, const Vec3& zero,
                       nc::TiltedPlane& block);
  /// What the words of a block mean.
  static PlaneFrame of(const nc::Controller& controller, const nc::TiltedPlane& block, const Vec3& zero);
};

}  // namespace trunnion::post
