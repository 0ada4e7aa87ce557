#include "trunnion/effects/deviation.hpp"

namespace trunnion {

DeviationMap::DeviationMap(const Machine& machine, const JointVector& q, const Vec3& tool_mm)
    : machine_(&machine), q_(q), tool_mm_(tool_mm), nominal_PT_(forward(machine, q, tool_mm)) {
  const Pose X_MP = part_in_machine(machine, q);
  const Vec3 tip_M = X_MP * nominal_PT_.p;
  R_MP_ = X_MP.R;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const JointFrame frame = joint_frame(machine, q, id);
    joint_[id] = {frame.R_M, tip_M - frame.origin_M, machine.axes[id].carries_part ? -1.0 : 1.0};
  }
  const Mat3 R_MS = X_MP.R * nominal_PT_.R;
  spindle_ = {R_MS, R_MS * tool_mm, 1.0};
  part_ = {X_MP.R, tip_M - X_MP.p, -1.0};
}

Deviation DeviationMap::exact_P(const ChainErrors& errors) const {
  const Pose actual = forward(*machine_, q_, tool_mm_, errors);
  return {actual.p - nominal_PT_.p, rotation_vector(actual.R * nominal_PT_.R.transpose())};
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
