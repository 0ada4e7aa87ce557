#pragma once
#include <algorithm>
#include <cmath>

#include "trunnion/geom/vec.hpp"

namespace trunnion::path {

/// How far the tool is off a place of the path: its tip, mm, and its axis, as the difference of unit vectors.
/// The point `s` mm up the tool is then off by tip_P + s axis_P: affine in s, so that no point between two
/// others is farther off than the farther one of them.
struct ToolOff {
  Vec3 tip_P = Vec3::Zero();
  Vec3 axis_P = Vec3::Zero();

  Vec3 at(double up_mm) const { return tip_P + up_mm * axis_P; }
  bool is_zero() const { return tip_P.isZero(0.0) && axis_P.isZero(0.0); }
  /// The largest distance of the points from the tip to `flute_mm` up the tool, mm.
  double largest_mm(double flute_mm) const {
    return std::sqrt(std::max(tip_P.squaredNorm(), at(flute_mm).squaredNorm()));
  }
};
inline ToolOff operator+(const ToolOff& a, const ToolOff& b) {
  return {a.tip_P + b.tip_P, a.axis_P + b.axis_P};
}
inline ToolOff operator-(const ToolOff& a, const ToolOff& b) {
  return {a.tip_P - b.tip_P, a.axis_P - b.axis_P};
}
inline ToolOff operator/(const ToolOff& off, double by) {
  return {off.tip_P / by, off.axis_P / by};
}
inline ToolOff operator*(double factor, const ToolOff& off) {
  return {factor * off.tip_P, factor * off.axis_P};
}

}  // namespace trunnion::path
