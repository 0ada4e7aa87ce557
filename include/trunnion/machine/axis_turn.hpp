#pragma once
#include <cstddef>

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
  Vec3 turned(const Vec3& v, double sin, double cos) const {
    switch (frame_axis_) {
      case 0:
        sin *= n_.x();
        return {v.x(), cos * v.y() - sin * v.z(), cos * v.z() + sin * v.y()};
      case 1:
        sin *= n_.y();
        return {cos * v.x() + sin * v.z(), v.y(), cos * v.z() - sin * v.x()};
      case 2:
        sin *= n_.z();
        return {cos * v.x() - sin * v.y(), cos * v.y() + sin * v.x(), v.z()};
      default:
        return cos * v + sin * n_.cross(v) + ((1.0 - cos) * n_.dot(v)) * n_;
    }
  }

 private:
  Vec3 n_;
  std::size_t frame_axis_ = 3;  // along or against which n_ points; 3 for none
};

}  // namespace trunnion
