#pragma once
#include <string>

#include "trunnion/machine/kinematics.hpp"

namespace trunnion::path {

/// What keeps the rotary axes from a tool axis.
struct Reach {
  double beyond_rad = 0.0;  // 0 when a position within the limits holds it
  std::string text;         // which axis, where it would have to go and by how much that is beyond its limits
};
Reach reach_of(const Machine& machine, const Vec3& axis_P, const InverseOptions& options);

/// "tool axis (i, j, k) cannot be reached: ...".
std::string unreachable_text(const Machine& machine, const Vec3& axis_P, const InverseOptions& options);

}  // namespace trunnion::path
