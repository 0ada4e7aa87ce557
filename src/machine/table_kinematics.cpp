#include "trunnion/machine/table_kinematics.hpp"

#include <Eigen/LU>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion {

// The part's chain from the bed outwards is undone joint by joint, p = J_n^-1 ... J_1^-1 p_M: a linear joint
// subtracts q e, a rotary one x -> o + R^T (x - o). Between the rotary joints everything is affine in the
// linear axes: the slots w, b, g.
TableKinematics::TableKinematics(const Machine& machine, const Vec3& tool_mm) {
  std::size_t linear_count = 0;
  const auto add_linear = [&](AxisId id, std::size_t slot, const Vec3& motion) {
    TRUNNION_EXPECTS(linear_count < linear_.size());
    linear_[linear_count++] = {id, slot, motion};
    linear_first_ = linear_first_ && slot == 0;
  };
  constant_[0] = tool_mm;
  for (const AxisId id : machine.tool_chain) {
    TRUNNION_EXPECTS(machine.axes[id].kind == AxisKind::linear);
    add_linear(id, 0, machine.axes[id].direction);
  }
  for (const AxisId id : machine.part_chain) {
    const Axis& axis = machine.axes[id];
    if (axis.kind == AxisKind::linear) {
      add_linear(id, rotary_count_, -axis.direction);
      continue;
    }
    TRUNNION_EXPECTS(rotary_count_ < 2);
    constant_[rotary_count_] -= axis.point_mm;
    turn_[rotary_count_] = AxisTurn(axis.direction);
    rotary_[rotary_count_] = id;
    constant_[++rotary_count_] += axis.point_mm;
  }
  constant_[rotary_count_] -= machine.part_zero_mm;
  TRUNNION_EXPECTS(linear_count == linear_.size());
  if (linear_first_) {
    Mat3 motion;
    for (Eigen::Index i = 0; i < 3; ++i) motion.col(i) = linear_[static_cast<std::size_t>(i)].motion;
    unmix_ = motion.inverse();
    along_xyz_ = motion == Mat3::Identity();
  }
}

Vec3 TableKinematics::solve_between(const Vec3& gap, const Sines& s) const {
  Mat3 motion;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const LinearAxis& axis = linear_[static_cast<std::size_t>(i)];
    Vec3 v = axis.motion;
    if (axis.slot == 2) v = turn(1, v, s);
    if (axis.slot >= 1) v = turn(0, v, s);
    motion.col(i) = v;
  }
  return motion.inverse() * gap;
}

}  // namespace trunnion
