#pragma once
#include "trunnion/geom/small_arc.hpp"
#include "trunnion/geom/vec.hpp"
#include "trunnion/path/smaller_of_two.hpp"

namespace trunnion::path {

inline lanes::Triple<double> triple_of(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
inline Vec3 vector_of(const lanes::Triple<double>& v) {
  return {v.x, v.y, v.z};
}

/// ToolOff of a few tools. T: double, Lanes, Quads.
template <class T>
struct ToolOffOf {
  lanes::Triple<T> tip_P, axis_P;

  lanes::Triple<T> at(double up_mm) const { return tip_P + up_mm * axis_P; }
};

/// The tool axis that stands beside one by so much.
template <class T>
lanes::Triple<T> axis_beside(const lanes::Triple<T>& axis_P, const lanes::Triple<T>& by) {
  const lanes::Triple<T> v = axis_P + by;
  const T length = lanes::sqrt(T(lanes::squared(v)));
  return {v.x / length, v.y / length, v.z / length};
}

/// FluteSegment of a few segments, the axes of which turn so little that a series tells their places.
template <class T>
class ToolSegmentOf {
 public:
  ToolSegmentOf(const lanes::Triple<T>& tip0_P, const lanes::Triple<T>& tip1_P,
                const lanes::Triple<T>& axis0_P, const lanes::Triple<T>& axis1_P, double flute_mm)
      : tip0_P_(tip0_P),
        chord_(tip1_P - tip0_P),
        turned_(axis1_P - axis0_P),
        arc_(axis0_P, axis1_P),
        flute_mm_(flute_mm) {}

  double flute_mm() const { return flute_mm_; }
  const SmallArc<T>& arc() const { return arc_; }
  ToolOffOf<T> off(const lanes::Triple<T>& tip_P, const lanes::Triple<T>& axis_P, const T& t) const {
    return {tip_P - tip0_P_ - t * chord_, axis_P - arc_.at(t)};
  }
  /// About the fraction at which the larger of both distances, of the tip and of the end of the flute, is
  /// smallest, for a tool about the middle: on five degrees of arc the third step settles it.
  T nearest(const lanes::Triple<T>& tip_P, const lanes::Triple<T>& axis_P) const {
    constexpr int kSteps = 3;
    const T one = lanes::splat<T>(1.0);
    T t = lanes::splat<T>(0.5);
    for (int i = 0; i < kSteps; ++i) {
      const ToolOffOf<T> here = off(tip_P, axis_P, t);
      t += smaller_of_two<T>(here.tip_P, chord_, here.at(flute_mm_), chord_ + flute_mm_ * turned_);
      t = lanes::select(t < 0.0, T{}, lanes::select(t > 1.0, one, t));
    }
    return t;
  }

 private:
  lanes::Triple<T> tip0_P_, chord_, turned_;
  SmallArc<T> arc_;
  double flute_mm_;
};

}  // namespace trunnion::path
