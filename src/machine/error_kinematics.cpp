#include "trunnion/machine/error_kinematics.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

// A point and a direction that are carried through the chain together.
struct Carried {
  Vec3 p;
  Vec3 u;
};

// exp(sign * twist) applied to both; the sign is -1 on the way back through a joint, whose inverse it is.
void displace(const Twist& twist, double sign, Carried& at) {
  // The series of `exp` (geom) below this angle; errors of machines are far below it.
  constexpr double kSeries = 1e-2;
  const Vec3 w = sign * twist.rot_rad;
  const double x2 = w.squaredNorm();
  if (x2 >= kSeries * kSeries) {
    const Pose X = exp(twist * sign);
    at = {X * at.p, X.R * at.u};
    return;
  }
  if (x2 == 0.0) {
    at.p += sign * twist.trans_mm;
    return;
  }
  const double a = 1.0 - x2 / 6.0 * (1.0 - x2 / 20.0);
  const double b = 0.5 - x2 / 24.0 * (1.0 - x2 / 30.0);
  const double c = 1.0 / 6.0 - x2 / 120.0;
  const auto turned = [&](const Vec3& v) {
    const Vec3 Kv = w.cross(v);
    return Vec3(v + a * Kv + b * w.cross(Kv));
  };
  const Vec3 t = sign * twist.trans_mm;
  const Vec3 Kt = w.cross(t);
  at = {turned(at.p) + t + b * Kt + c * w.cross(Kt), turned(at.u)};
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
  Carried at{tool_mm_, Vec3::UnitZ()};
  displace(errors.spindle, 1.0, at);
  for (const Joint& joint : tool_chain_) {
    at.p -= joint.point_mm;
    displace(errors.joint[joint.id], 1.0, at);
    at.p += joint.point_mm + q[joint.id] * joint.turn.direction();
  }
  std::size_t k = 0;
  for (const Joint& joint : part_chain_) {
    at.p -= joint.point_mm;
    if (!joint.rotary) at.p -= q[joint.id] * joint.turn.direction();
    displace(errors.joint[joint.id], -1.0, at);
    if (joint.rotary) {
      at.p = joint.turn.turned(at.p, -sines.sin[k], sines.cos[k]);
      at.u = joint.turn.turned(at.u, -sines.sin[k], sines.cos[k]);
      ++k;
    }
    at.p += joint.point_mm;
  }
  at.p -= part_zero_mm_;
  displace(errors.part, -1.0, at);
  return {at.p, at.u};
}

}  // namespace trunnion
