#include "trunnion/machine/kinematics.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

// Direction of the spindle, from the tip upwards, when no axis of the tool side turns.
const Vec3 kSpindle_M = Vec3::UnitZ();

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

// Angle by which a turn about n takes the part of `from` across n to that of `to`.
double turn_between(const Vec3& n, const Vec3& from, const Vec3& to) {
  const Vec3 a = from - n.dot(from) * n;
  const Vec3 b = to - n.dot(to) * n;
  return std::atan2(n.dot(a.cross(b)), a.dot(b));
}

double wrap(double angle) {
  const double wrapped = std::remainder(angle, kTwoPi);
  return wrapped <= -kPi ? kPi : wrapped;
}

// No rotary axis, or one: the tool axis must be where the axis can turn it.
RotarySolutions single_rotary(const Vec3* n, const Vec3& axis_P, double slack, double seed) {
  RotarySolutions out;
  RotarySolution s;
  Vec3 reached = axis_P;
  if (n != nullptr) {
    // No direction of its own when the tool stands along the axis.
    s.singular = axis_P.cross(*n).norm() < kFreeTilt;
    s.angle[0] = s.singular ? seed : wrap(turn_between(*n, axis_P, kSpindle_M));
    reached = rotation_about(*n, Angle::radians(s.angle[0])) * axis_P;
  }
  out.missing_by = angle_between(reached, kSpindle_M);
  if (out.missing_by.rad() > std::max(slack, 1e-12)) return out;
  out.at[0] = s;
  out.count = 1;
  return out;
}

// Quantities of the two-rotation problem: Rot(n1, A) Rot(n2, C) u = k with v = Rot(n2, C) u = al n1 + be n2 +
// ga (n1 x n2).
struct TwoRotations {
  const Vec3& n1;
  const Vec3& n2;
  Vec3 u;
  Vec3 m;  // n1 x n2
  double sin_tilt;
  double b;  // n2.u
  double S;  // |n2 x u| |n1 x n2|
  double D;  // n1.k - (n2.u)(n1.n2)

  TwoRotations(const Vec3& outer, const Vec3& inner, const Vec3& axis_P)
      : n1(outer), n2(inner), u(axis_P), m(n1.cross(n2)), sin_tilt(n2.cross(u).norm()), b(n2.dot(u)) {
    // 1 - b without cancellation near the pole.
    const double one_minus_b = b > 0.0 ? sin_tilt * sin_tilt / (1.0 + b) : 1.0 - b;
    S = sin_tilt * m.norm();
    D = n1.dot(kSpindle_M - n2) + n1.dot(n2) * one_minus_b;
  }

  // v of the branch with ga = sign sqrt(S^2 - D^2) / |n1 x n2|^2.
  Vec3 v(double sign) const {
    const double m2 = m.squaredNorm();
    const double c = n1.dot(n2);
    const double a = n1.dot(kSpindle_M);
    const double root = std::sqrt(std::max(0.0, (S - D) * (S + D)));
    return ((a - c * b) * n1 + (b - c * a) * n2 + sign * root * m) / m2;
  }
};

RotarySolution solve_branch(const TwoRotations& problem, double sign, double seed_inner,
                            const InverseOptions& options) {
  RotarySolution s;
  s.branch = sign > 0.0 ? 0 : 1;
  const Vec3 v = problem.v(sign);
  const double sin_tilt = problem.sin_tilt;
  s.angle[1] = sin_tilt < kFreeTilt ? seed_inner : wrap(turn_between(problem.n2, problem.u, v));
  s.angle[0] = wrap(turn_between(problem.n1, v, kSpindle_M));
  s.singular = sin_tilt < kFreeTilt;
  if (sin_tilt < kDigitTilt && !s.singular) {
    // C kept from before as long as the tool axis then errs by less than half a digit of the CL file.
    const Vec3 kept = rotation_about(problem.n1, Angle::radians(s.angle[0])) *
                      (rotation_about(problem.n2, Angle::radians(seed_inner)) * problem.u);
    if (angle_between(kept, kSpindle_M).rad() < options.axis_resolution) {
      s.angle[1] = seed_inner;
      s.singular = true;
    }
  }
  return s;
}

RotarySolutions two_rotary(const Vec3& outer, const Vec3& inner, const Vec3& axis_P, double seed_inner,
                           const InverseOptions& options) {
  const TwoRotations problem(outer, inner, axis_P);
  RotarySolutions out;
  const double short_by = std::abs(problem.D) - problem.S;  // of |n1 x n2| times the sine
  const double sin_axes = problem.m.norm();
  if (short_by > std::max(options.axis_resolution, kFreeTilt) * sin_axes) {
    // The nearest reachable tilt differs by the difference of the two angles to the inner axis.
    const double reach = std::atan2(std::abs(problem.D),
                                    std::sqrt(std::max(0.0, sin_axes * sin_axes - problem.D * problem.D)));
    const double tilt = std::asin(std::min(1.0, problem.S / sin_axes));
    out.missing_by =
        Angle::radians(std::isfinite(reach) ? std::max(std::abs(reach - tilt), short_by) : short_by);
    return out;
  }
  out.at[0] = solve_branch(problem, 1.0, seed_inner, options);
  out.count = 1;
  // Tangent: both branches are the same within what doubles can tell (a square root of rounding).
  constexpr double kTangent = 1e-15;
  if ((problem.S - problem.D) * (problem.S + problem.D) > kTangent * kTangent) {
    out.at[1] = solve_branch(problem, -1.0, seed_inner, options);
    out.count = 2;
  }
  return out;
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

RotarySolutions rotary_solutions(const Machine& machine, const Vec3& axis_P, double seed_inner,
                                 const InverseOptions& options) {
  std::array<AxisId, 2> rotary{};
  std::size_t count = 0;
  for (const AxisId id : machine.part_chain) {
    if (machine.axes[id].kind == AxisKind::rotary) rotary[count++] = id;
  }
  if (count == 2) {
    return two_rotary(machine.axes[rotary[0]].direction, machine.axes[rotary[1]].direction, axis_P,
                      seed_inner, options);
  }
  const Vec3* n = count == 1 ? &machine.axes[rotary[0]].direction : nullptr;
  return single_rotary(n, axis_P, options.axis_resolution, seed_inner);
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
