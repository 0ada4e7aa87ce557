#pragma once
#include <cstddef>
#include <cstring>

#include "trunnion/base/lanes.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::post {

/// Positions of the axes `id` and `id` + 1 side by side.
inline Lanes joint_pair(const JointVector& q, AxisId id) {
  static_assert(sizeof(JointVector) == kMaxAxes * sizeof(double));
  Lanes out;
  std::memcpy(&out, reinterpret_cast<const std::byte*>(&q) + id * sizeof(double), sizeof(out));
  return out;
}

}  // namespace trunnion::post
