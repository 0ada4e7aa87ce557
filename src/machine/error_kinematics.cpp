#include "trunnion/machine/error_kinematics.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

// A point and a direction that are carried through the chain side by side, in this order.
using Carried = lanes::Triple<Lanes>;

// Of a vector by which only the point goes on.
Carried of_point(const Vec3& v) {
  return {Lanes{v.x(), 0.0}, Lanes{v.y(), 0.0}, Lanes{v.z(), 0.0}};
}
Vec3 lane(const Carried& at, int i) {
  return {at.x[i], at.y[i], at.z[i]};
}

// exp(sign * twist) applied to both; the sign is -1 on the way back through a joint, whose inverse it is.
Carried displaced_far(const Twist& twist, double sign, const Carried& at) {
  const Pose X = exp(twist * sign);
  const Vec3 p = X * lane(at, 0);
  const Vec3 u = X.R * lane(at, 1);
  return {Lanes{p.x(), u.x()}, Lanes{p.y(), u.y()}, Lanes{p.z(), u.z()}};
}

// A call would take both through memory.
[[gnu::always_inline]] inline void displace(const Twist& twist, double sign, Carried& at) {
  const Carried t = of_point(sign * twist.trans_mm);
  // Most errors do not turn anything.
  if (twist.rot_rad.x() == 0.0 && twist.rot_rad.y() == 0.0 && twist.rot_rad.z() == 0.0) {
    at = at + t;
    return;
  }
  // The series of `exp` (geom) below this angle; errors of machines are far below it.
  constexpr double kSeries = 1e-2;
  const lanes::Triple<double> w{sign * twist.rot_rad.x(), sign * twist.rot_rad.y(), sign * twist.rot_rad.z()};
  const double x2 = lanes::squared(w);
  if (x2 >= kSeries * kSeries) {
    at = displaced_far(twist, sign, at);
    return;
  }
  // exp(twist) v = v + t + K (a v + b t + K (b v + c t)), K u = w x u.
  const double a = 1.0 - x2 * (1.0 / 6.0) * (1.0 - x2 * (1.0 / 20.0));
  const double b = 0.5 - x2 * (1.0 / 24.0) * (1.0 - x2 * (1.0 / 30.0));
  const double c = 1.0 / 6.0 - x2 * (1.0 / 120.0);
  const Carried inner = lanes::cross(w, b * at + c * t);
  at = at + (t + lanes::cross(w, a * at + b * t + inner));
}

}  // namespace

std::vector<ErrorKinematics::Joint> ErrorKinematics::joints_of(const Machine& machine,
                                                               const std::vector<AxisId>& chain) {
  std::vector<Joint> out;
  out.reserve(chain.size());
  for (const AxisId id : chain) {
    const Axis& axis = machine.axes[id];
    out.push_back({id, axis.kind == AxisKind::rotary, AxisTurn(axis.direction), axis.point_mm});
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

// The joint poses of `forward` (kinematics.cpp): Trans(q e) Trans(o) Exp(xi) Trans(-o) for a linear axis,
// Trans(a) Exp(xi) Rot(n, q) Trans(-a) for a rotary one; the part's chain is undone from the bed outwards.
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

ToolPose ErrorKinematics::pose(const JointVector& q, const RotarySines& sines,
                               const ChainErrors& errors) const {
  Carried at{Lanes{tool_mm_.x(), 0.0}, Lanes{tool_mm_.y(), 0.0}, Lanes{tool_mm_.z(), 1.0}};
  displace(errors.spindle, 1.0, at);
  for (const Joint& joint : tool_chain_) {
    at = at - of_point(joint.point_mm);
    displace(errors.joint[joint.id], 1.0, at);
    at = at + of_point(joint.point_mm + q[joint.id] * joint.turn.direction());
  }
  std::size_t k = 0;
  for (const Joint& joint : part_chain_) {
    Vec3 to_joint = joint.point_mm;
    if (!joint.rotary) to_joint += q[joint.id] * joint.turn.direction();
    at = at - of_point(to_joint);
    displace(errors.joint[joint.id], -1.0, at);
    if (joint.rotary) {
      at = joint.turn.turned(at, lanes::splat<Lanes>(-sines.sin[k]), lanes::splat<Lanes>(sines.cos[k]));
      ++k;
    }
    at = at + of_point(joint.point_mm);
  }
  at = at - of_point(part_zero_mm_);
  displace(errors.part, -1.0, at);
  return {lane(at, 0), lane(at, 1)};
}

}  // namespace trunnion
