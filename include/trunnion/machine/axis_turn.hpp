#pragma once
#include <cstddef>

#include "trunnion/base/lanes.hpp"
#include "trunnion/geom/vec.hpp"

namespace trunnion {

/// Turns about one axis, prepared: nearly all machines have their rotary axes along X, Y or Z.
class AxisTurn {
 public:
  AxisTurn() : AxisTurn(Vec3::UnitX()) {}
  /// `direction`: unit.
  explicit AxisTurn(const Vec3& direction) : n_(direction) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      if (n_.cwiseAbs() == Vec3::Unit(i)) frame_axis_ = static_cast<std::size_t>(i);
    }
  }
  const Vec3& direction() const { return n_; }

  /// `v` turned by the angle of this sine and cosine, right-hand rule.
  template <class T>
  lanes::Triple<T> turned(const lanes::Triple<T>& v, const T& sin, const T& cos) const {
    switch (frame_axis_) {
      case 0: {
        const T s = sin * n_.x();
        return {v.x, cos * v.y - s * v.z, cos * v.z + s * v.y};
      }
      case 1: {
        const T s = sin * n_.y();
        return {cos * v.x + s * v.z, v.y, cos * v.z - s * v.x};
      }
      case 2: {
        const T s = sin * n_.z();
        return {cos * v.x - s * v.y, cos * v.y + s * v.x, v.z};
      }
      default: {
        const lanes::Triple<double> n{n_.x(), n_.y(), n_.z()};
        const lanes::Triple<T> across = lanes::cross(n, v);
        const T along = (1.0 - cos) * lanes::dot(n, v);
        return {cos * v.x + sin * across.x + along * n.x, cos * v.y + sin * across.y + along * n.y,
                cos * v.z + sin * across.z + along * n.z};
      }
    }
  }
  Vec3 turned(const Vec3& v, double sin, double cos) const {
    const lanes::Triple<double> out = turned(lanes::Triple<double>{v.x(), v.y(), v.z()}, sin, cos);
    return {out.x, out.y, out.z};
  }

 private:
  Vec3 n_;
  std::size_t frame_axis_ = 3;  // along or against which n_ points; 3 for none
};

}  // namespace trunnion
