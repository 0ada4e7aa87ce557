#pragma once
#include "trunnion/base/lanes.hpp"

namespace trunnion {

/// The great circle between two unit vectors that are so near that a series tells its points. T: double,
/// Lanes, Quads.
template <class T>
class SmallArc {
 public:
  SmallArc(const lanes::Triple<T>& u0, const lanes::Triple<T>& u1)
      : u0_(u0), u1_(u1), chord2_(lanes::squared(u1 - u0)) {
    // (2 arcsin(c / 2))^2
    angle2_ =
        chord2_ *
        (1.0 + chord2_ * (1.0 / 12.0 +
                          chord2_ * (1.0 / 90.0 + chord2_ * (1.0 / 560.0 +
                                                             chord2_ * (1.0 / 3150.0 + chord2_ / 16632.0)))));
  }
  /// The series holds: neither far apart nor the same.
  auto holds() const {
    constexpr double kFarthest = 8e-3;  // 5.1 degrees
    constexpr double kSameAxis = 1e-24;
    return (chord2_ < kFarthest) & (chord2_ > kSameAxis);
  }
  /// Angle, rad.
  T turn() const { return lanes::sqrt(angle2_); }
  /// Unit vector at the share `t` of the way.
  lanes::Triple<T> at(const T& t) const {
    const lanes::Triple<T> v = share(1.0 - t) * u0_ + share(t) * u1_;
    const T length = lanes::sqrt(T(lanes::squared(v)));
    return {v.x / length, v.y / length, v.z / length};
  }

 private:
  // sin(t omega) / sin(omega): the first term left out is below 1e-18.
  T share(const T& t) const {
    const T t2 = t * t;
    const T c1 = (1.0 - t2) / 6.0;
    const T c2 = (7.0 - t2 * (10.0 - 3.0 * t2)) / 360.0;
    const T c3 = (31.0 - t2 * (49.0 - t2 * (21.0 - 3.0 * t2))) / 15120.0;
    const T c4 = (381.0 - t2 * (620.0 - t2 * (294.0 - t2 * (60.0 - 5.0 * t2)))) / 1814400.0;
    const T c5 =
        (2555.0 - t2 * (4191.0 - t2 * (2046.0 - t2 * (462.0 - t2 * (55.0 - 3.0 * t2))))) / 119750400.0;
    return t * (1.0 + angle2_ * (c1 + angle2_ * (c2 + angle2_ * (c3 + angle2_ * (c4 + angle2_ * c5)))));
  }

  lanes::Triple<T> u0_, u1_;
  T chord2_, angle2_;
};

}  // namespace trunnion
