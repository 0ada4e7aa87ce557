#include "trunnion/machine/error_kinematics.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

lanes::Triple<double> triple(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
// Of a vector by which only the point goes on.
lanes::Triple<Lanes> of_point(const lanes::Triple<double>& v) {
  return {Lanes{v.x, 0.0}, Lanes{v.y, 0.0}, Lanes{v.z, 0.0}};
}
Vec3 lane(const lanes::Triple<Lanes>& at, int i) {
  return {at.x[i], at.y[i], at.z[i]};
}

bool turns_nothing(const Vec3& rot_rad) {
  return rot_rad.x() == 0.0 && rot_rad.y() == 0.0 && rot_rad.z() == 0.0;
}

}  // namespace

// The tool at one position: its point and its direction side by side, in this order.
struct ErrorKinematics::OneTool {
  const JointVector& q;
  const RotarySines& sines;
  const ChainErrors& errors;
  lanes::Triple<Lanes> at;

  [[gnu::always_inline]] void move(const lanes::Triple<double>& v) { at = at + of_point(v); }
  [[gnu::always_inline]] void advance(const Joint& joint, double sign) {
    move(sign * q[joint.id] * triple(joint.turn.direction()));
  }
  [[gnu::always_inline]] void turn_back(const AxisTurn& axis, std::size_t k) {
    at = axis.turned(at, lanes::splat<Lanes>(-sines.sin[k]), lanes::splat<Lanes>(sines.cos[k]));
  }
  [[gnu::always_inline]] void apply(const Held& held) {
    if (held.turns) at = held.turned(at);
    if (held.moves) move(held.shift_mm);
  }
  // exp(sign * twist) applied to both; the sign is -1 on the way back through a joint, whose inverse it is.
  template <class TwistAt>
  [[gnu::always_inline]] void displace(const TwistAt& twist_at, double sign) {
    const Twist& twist = twist_at(errors);
    const lanes::Triple<Lanes> t = of_point(sign * triple(twist.trans_mm));
    // Most errors do not turn anything.
    if (turns_nothing(twist.rot_rad)) {
      at = at + t;
      return;
    }
    const Series<double> series(sign * triple(twist.rot_rad));
    if (series.is_near()) {
      at = series.displaced(at, t);
      return;
    }
    const Pose X = exp(twist * sign);
    const Vec3 p = X * lane(at, 0);
    const Vec3 u = X.R * lane(at, 1);
    at = {Lanes{p.x(), u.x()}, Lanes{p.y(), u.y()}, Lanes{p.z(), u.z()}};
  }
};

ErrorKinematics::Held::Held(const Twist& twist, double sign, const Vec3& point_mm) : known(true) {
  const Pose X = exp(twist * sign);
  turns = !turns_nothing(twist.rot_rad);
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) rotation[static_cast<std::size_t>(3 * i + j)] = X.R(i, j);
  }
  shift_mm = triple(X.p - (turns ? Vec3(X.R * point_mm) : point_mm));
  moves = shift_mm.x != 0.0 || shift_mm.y != 0.0 || shift_mm.z != 0.0;
}

void ErrorKinematics::hold(const ChainErrors& constant, const ChainLinks& varying) {
  if (!varying.spindle) spindle_ = Held(constant.spindle, 1.0, Vec3::Zero());
  if (!varying.part) part_ = Held(constant.part, -1.0, part_zero_mm_);
  for (auto* chain : {&tool_chain_, &part_chain_}) {
    const double sign = chain == &tool_chain_ ? 1.0 : -1.0;
    for (Joint& joint : *chain) {
      if (!varying.joint[joint.id]) joint.held = Held(constant.joint[joint.id], sign, joint.point_mm);
    }
  }
}

std::vector<ErrorKinematics::Joint> ErrorKinematics::joints_of(const Machine& machine,
                                                               const std::vector<AxisId>& chain) {
  std::vector<Joint> out;
  out.reserve(chain.size());
  for (const AxisId id : chain) {
    const Axis& axis = machine.axes[id];
    out.push_back({id,
                   axis.kind == AxisKind::rotary,
                   AxisTurn(axis.direction),
                   axis.point_mm,
                   !axis.point_mm.isZero(0.0),
                   {}});
  }
  return out;
}

ErrorKinematics::ErrorKinematics(const Machine& machine, const Vec3& tool_mm)
    : tool_chain_(joints_of(machine, machine.tool_chain)),
      part_chain_(joints_of(machine, machine.part_chain)),
      tool_mm_(tool_mm),
      part_zero_mm_(machine.part_zero_mm) {
  std::reverse(tool_chain_.begin(), tool_chain_.end());
  for (const Joint& joint : tool_chain_) TRUNNION_EXPECTS(!joint.rotary);
}

ToolPose ErrorKinematics::pose(const JointVector& q, const ChainErrors& errors) const {
  RotarySines sines;
  std::size_t k = 0;
  for (const Joint& joint : part_chain_) {
    if (!joint.rotary) continue;
    sines.sin[k] = std::sin(q[joint.id]);
    sines.cos[k++] = std::cos(q[joint.id]);
  }
  return pose(q, sines, errors);
}

[[gnu::flatten]] ToolPose ErrorKinematics::pose(const JointVector& q, const RotarySines& sines,
                                                const ChainErrors& errors) const {
  OneTool tool{
      q, sines, errors, {Lanes{tool_mm_.x(), 0.0}, Lanes{tool_mm_.y(), 0.0}, Lanes{tool_mm_.z(), 1.0}}};
  carry(tool);
  return {lane(tool.at, 0), lane(tool.at, 1)};
}

}  // namespace trunnion
