#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace trunnion {

/// Plain vectors and matrices. The frame stands in the variable's name: `p_PT_P` or short `p_P` is a point of
/// P in the axes of P.
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// The matrix K with K w = v x w.
inline Mat3 cross_matrix(const Vec3& v) {
  Mat3 k;
  k << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return k;
}

}  // namespace trunnion
