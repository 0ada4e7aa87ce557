#include "trunnion/effects/deviation.hpp"

namespace trunnion {

DeviationMap::DeviationMap(const Machine& machine, const JointVector& q, const Vec3& tool_mm)
    : machine_(&machine) {
  const Pose nominal_PT = forward(machine, q, tool_mm);
  const Pose X_MP = part_in_machine(machine, q);
  const Vec3 tip_M = X_MP * nominal_PT.p;
  R_MP_ = X_MP.R;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const JointFrame frame = joint_frame(machine, q, id);
    joint_[id] = {frame.R_M, tip_M - frame.origin_M, machine.axes[id].carries_part ? -1.0 : 1.0};
  }
  const Mat3 R_MS = X_MP.R * nominal_PT.R;
  spindle_ = {R_MS, R_MS * tool_mm, 1.0};
  part_ = {X_MP.R, tip_M - X_MP.p, -1.0};
}

// A Exp(xi) A^-1 = Exp(Ad_A xi): about the tool point, in the axes of M, every joint's motion is the
// exponential of its first-order twist, whatever the nominal pose before and behind it. Those of the part's
// side come inverted, outermost first.
Deviation DeviationMap::exact_M(const ChainErrors& errors) const {
  Pose moved = Pose::identity();
  const auto add = [&](const Link& link, const Twist& error) {
    if (error.is_zero()) return;
    const Deviation d = linear_M(link, error);
    moved = moved * exp(Twist{d.displacement_mm, d.rotation_rad});
  };
  add({Link::Kind::part, 0}, errors.part);
  const auto& part_chain = machine_->part_chain;
  for (auto id = part_chain.rbegin(); id != part_chain.rend(); ++id)
    add({Link::Kind::joint, *id}, errors.joint[*id]);
  for (const AxisId id : machine_->tool_chain) add({Link::Kind::joint, id}, errors.joint[id]);
  add({Link::Kind::spindle, 0}, errors.spindle);
  return {moved.p, rotation_vector(moved.R)};
}

const DeviationMap::Lever& DeviationMap::lever_of(const Link& link) const {
  switch (link.kind) {
    case Link::Kind::spindle:
      return spindle_;
    case Link::Kind::part:
      return part_;
    case Link::Kind::joint:
      break;
  }
  return joint_[link.axis];
}

Deviation DeviationMap::linear_M(const Link& link, const Twist& twist) const {
  const Lever& l = lever_of(link);
  const Vec3 rotation = l.sign * (l.R_M * twist.rot_rad);
  return {l.sign * (l.R_M * twist.trans_mm) + rotation.cross(l.lever_M), rotation};
}

}  // namespace trunnion
