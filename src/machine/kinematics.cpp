#include "trunnion/machine/kinematics.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

Pose joint_pose(const Axis& axis, double q) {
  if (axis.kind == AxisKind::linear) return Pose::translation(q * axis.direction);
  return Pose::rotation(axis.direction, axis.point_mm, Angle::radians(q));
}

// Linear: Trans(q e) Trans(o) Exp(xi) Trans(-o), o the carriage point; rotary: Trans(a) Exp(xi) Rot(n, q)
// Trans(-a).
Pose joint_pose(const Axis& axis, double q, const Twist& error) {
  if (error.is_zero()) return joint_pose(axis, q);
  const Pose at_point = Pose::translation(axis.point_mm) * exp(error);
  if (axis.kind == AxisKind::linear) {
    return Pose::translation(q * axis.direction) * at_point * Pose::translation(-axis.point_mm);
  }
  return at_point * Pose{rotation_about(axis.direction, Angle::radians(q)), Vec3::Zero()} *
         Pose::translation(-axis.point_mm);
}

Pose chain_pose(const Machine& machine, const std::vector<AxisId>& chain, const JointVector& q) {
  Pose X = Pose::identity();
  for (const AxisId id : chain) X = X * joint_pose(machine.axes[id], q[id]);
  return X;
}

Pose chain_pose(const Machine& machine, const std::vector<AxisId>& chain, const JointVector& q,
                const ChainErrors& errors) {
  Pose X = Pose::identity();
  for (const AxisId id : chain) X = X * joint_pose(machine.axes[id], q[id], errors.joint[id]);
  return X;
}

}  // namespace

Pose forward(const Machine& machine, const JointVector& q, const Vec3& tool_mm) {
  const Pose X_MT = chain_pose(machine, machine.tool_chain, q) * Pose::translation(tool_mm);
  return part_in_machine(machine, q).inverse() * X_MT;
}

Pose forward(const Machine& machine, const JointVector& q, const Vec3& tool_mm, const ChainErrors& errors) {
  const Pose X_MT =
      chain_pose(machine, machine.tool_chain, q, errors) * exp(errors.spindle) * Pose::translation(tool_mm);
  const Pose X_MP = chain_pose(machine, machine.part_chain, q, errors) *
                    Pose::translation(machine.part_zero_mm) * exp(errors.part);
  return X_MP.inverse() * X_MT;
}

Pose part_in_machine(const Machine& machine, const JointVector& q) {
  return chain_pose(machine, machine.part_chain, q) * Pose::translation(machine.part_zero_mm);
}

JointFrame joint_frame(const Machine& machine, const JointVector& q, AxisId id) {
  const auto& chain = machine.axes[id].carries_part ? machine.part_chain : machine.tool_chain;
  Pose X = Pose::identity();
  for (const AxisId other : chain) {
    if (other == id) break;
    X = X * joint_pose(machine.axes[other], q[other]);
  }
  const Axis& axis = machine.axes[id];
  const Vec3 moved = axis.kind == AxisKind::linear ? Vec3(q[id] * axis.direction) : Vec3::Zero();
  return {X.R, X * (axis.point_mm + moved)};
}

void solve_linear(const Machine& machine, const Vec3& tip_P, const Vec3& tool_mm, JointVector& q) {
  // Columns: how each linear axis moves the tip relative to the part, in M.
  Mat3 motion;
  std::array<AxisId, 3> ids{};
  Eigen::Index column = 0;
  for (const AxisId id : machine.tool_chain) {
    if (machine.axes[id].kind != AxisKind::linear) continue;
    q[id] = 0.0;
    ids[static_cast<std::size_t>(column)] = id;
    motion.col(column++) = machine.axes[id].direction;
  }
  Mat3 R = Mat3::Identity();
  for (const AxisId id : machine.part_chain) {
    const Axis& axis = machine.axes[id];
    if (axis.kind == AxisKind::rotary) {
      R = R * rotation_about(axis.direction, Angle::radians(q[id]));
      continue;
    }
    q[id] = 0.0;
    ids[static_cast<std::size_t>(column)] = id;
    motion.col(column++) = -(R * axis.direction);
  }
  TRUNNION_EXPECTS(column == 3);
  const Vec3 target_M = part_in_machine(machine, q) * tip_P - tool_mm;
  const Vec3 solved = motion.inverse() * target_M;
  for (Eigen::Index i = 0; i < 3; ++i) q[ids[static_cast<std::size_t>(i)]] = solved[i];
}

std::optional<double> nearest_turn(const Axis& axis, double angle, double seed) {
  // Nearly always it is this turn.
  if (std::abs(seed - angle) < kPi && axis.within_limits(angle)) return angle;
  double best = angle + kTwoPi * std::nearbyint((seed - angle) / kTwoPi);
  if (!axis.has_limits() || axis.within_limits(best)) return best;
  // A command at a limit may miss it by the rounding of the angle itself.
  constexpr double kAtLimit = 1e-12;
  const double first = std::ceil((axis.min - angle - kAtLimit) / kTwoPi);
  const double last = std::floor((axis.max - angle + kAtLimit) / kTwoPi);
  if (first > last) return std::nullopt;
  best = angle + kTwoPi * std::clamp(std::nearbyint((seed - angle) / kTwoPi), first, last);
  return std::clamp(best, axis.min, axis.max);
}

std::vector<JointSolution> inverse(const Machine& machine, const ToolPose& pose, const JointVector& seed,
                                   const InverseOptions& options) {
  const std::vector<AxisId> rotary = machine.rotary_axes();
  const double seed_inner = rotary.empty() ? 0.0 : seed[rotary.back()];
  const RotarySolutions solutions = rotary_solutions(machine, pose.axis_P, seed_inner, options);
  std::vector<JointSolution> out;
  for (std::size_t i = 0; i < solutions.count; ++i) {
    JointSolution s{seed, solutions.at[i].branch, solutions.at[i].singular};
    bool reachable = true;
    for (std::size_t k = 0; k < rotary.size(); ++k) {
      const auto angle = nearest_turn(machine.axes[rotary[k]], solutions.at[i].angle[k], seed[rotary[k]]);
      reachable = reachable && angle.has_value();
      if (angle) s.q[rotary[k]] = *angle;
    }
    if (!reachable) continue;
    solve_linear(machine, pose.tip_P, machine.tool_vector(), s.q);
    out.push_back(s);
  }
  const auto travel = [&](const JointSolution& s) {
    double sum = 0.0;
    for (const AxisId id : rotary) sum += std::abs(s.q[id] - seed[id]);
    return sum;
  };
  std::stable_sort(out.begin(), out.end(),
                   [&](const JointSolution& a, const JointSolution& b) { return travel(a) < travel(b); });
  return out;
}

std::vector<LimitViolation> limit_violations(const Machine& machine, const JointVector& q) {
  std::vector<LimitViolation> out;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const Axis& axis = machine.axes[id];
    if (!axis.has_limits() || axis.within_limits(q[id])) continue;
    out.push_back({id, q[id], q[id] < axis.min ? axis.min - q[id] : q[id] - axis.max});
  }
  return out;
}

namespace {

// What the word of a linear axis has more than the joint position: the tool vector and the work offset, seen
// along the way in which the coordinate counts (against the body's motion when the body is the part).
JointVector word_offsets(const Machine& machine, const Vec3& tool_mm) {
  JointVector out;
  const Vec3 point = machine.output_point == OutputPoint::tip ? tool_mm : Vec3::Zero();
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const Axis& axis = machine.axes[id];
    if (axis.kind != AxisKind::linear) continue;
    const double sense = axis.carries_part ? -1.0 : 1.0;
    out[id] = sense * axis.direction.dot(point - machine.work_offset_mm);
  }
  return out;
}

}  // namespace

JointVector words_of(const Machine& machine, const JointVector& q, const Vec3& tool_mm) {
  const JointVector offsets = word_offsets(machine, tool_mm);
  JointVector out;
  for (AxisId id = 0; id < machine.axes.size(); ++id) out[id] = q[id] + offsets[id];
  return out;
}

JointVector joints_of_words(const Machine& machine, const JointVector& words, const Vec3& tool_mm) {
  const JointVector offsets = word_offsets(machine, tool_mm);
  JointVector out;
  for (AxisId id = 0; id < machine.axes.size(); ++id) out[id] = words[id] - offsets[id];
  return out;
}

}  // namespace trunnion
