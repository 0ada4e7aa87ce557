#include "trunnion/path/compensation.hpp"

#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"

namespace trunnion::path {

Compensator::Compensator(const Machine& machine, const Model& model, const Vec3& tool_mm,
                         const CompensationOptions& options)
    : machine_(machine),
      evaluator_(model),
      options_(options),
      kinematics_(machine, tool_mm),
      solver_(machine),
      with_errors_(machine, tool_mm),
      course_(machine, tool_mm, evaluator_),
      datum_shift_P_(datum_shift_P(machine, evaluator_)) {
  with_errors_.hold(evaluator_.constant(), evaluator_.varying());
}

ToolPose Compensator::actual(const MachineState& at, std::span<const double> lagged) const {
  return actual(at, kinematics_.sines(at.q), lagged);
}

ToolPose Compensator::actual(const MachineState& at, const RotarySines& sines,
                             std::span<const double> lagged) const {
  ToolPose pose = with_errors_.pose(at.q, sines, evaluator_.errors(at, lagged));
  pose.tip_P -= datum_shift_P_;
  return pose;
}

// Rotary positions for the wanted axis, of the branch and turn nearest to q; false where C has too little
// hold.
bool Compensator::turn_rotaries(const Vec3& axis_P, JointVector& q) const {
  const std::size_t count = kinematics_.rotary_count();
  if (count < 2) return false;
  const AxisId outer = kinematics_.rotary(0);
  const AxisId inner = kinematics_.rotary(1);
  if (axis_P.cross(kinematics_.direction(1)).norm() < options_.min_sin_tilt) return false;
  const RotarySolutions solutions = solver_.solve(axis_P, q[inner]);
  double nearest = std::numeric_limits<double>::infinity();
  JointVector best = q;
  for (std::size_t i = 0; i < solutions.count; ++i) {
    const auto& s = solutions.at[i];
    const double A = q[outer] + std::remainder(s.angle[0] - q[outer], kTwoPi);
    const double C = q[inner] + std::remainder(s.angle[1] - q[inner], kTwoPi);
    const double distance = std::abs(A - q[outer]) + std::abs(C - q[inner]);
    if (distance >= nearest) continue;
    nearest = distance;
    best[outer] = A;
    best[inner] = C;
  }
  // Where the branches meet (the axis only just in reach) a small error may have no near solution.
  constexpr double kFar = 0.01;  // rad; errors of an axis are 1e-4, divided by min_sin_tilt
  if (nearest > kFar) return false;
  q = best;
  return true;
}

Result<Corrected> Compensator::corrected(const Vec3& tip_P, const Vec3& axis_P, const MachineState& at,
                                         std::span<const double> lagged, const Vec3& near) const {
  MachineState state = at;
  const RangeCheck range = evaluator_.check_range(state);
  if (range.verdict == RangeCheck::Verdict::refused) return fail(ErrorCode::check_failed, range.message);
  Corrected out;
  out.held = range.verdict == RangeCheck::Verdict::held;
  Vec3 target_P = tip_P + near;
  Vec3 target_axis_P = axis_P;
  bool turns = options_.orientation;
  TableKinematics::Sines sines = kinematics_.sines(state.q);
  kinematics_.solve_linear(target_P, sines, state.q);
  for (;;) {
    const ToolPose actual_pose = actual(state, sines, lagged);
    const Vec3 error_P = actual_pose.tip_P - tip_P;
    out.left_mm = error_P.norm();
    out.axis_P = actual_pose.axis_P;
    if (out.steps == 0) out.before_mm = (actual_pose.tip_P - target_P).norm();
    constexpr double kAxisConverged = 1e-10;  // rad: 0.1 nm at 1 m
    const bool axis_done = !turns || angle_between(actual_pose.axis_P, axis_P).rad() < kAxisConverged;
    if (out.left_mm < options_.converged_mm && axis_done) break;
    if (out.steps == options_.max_steps) {
      return fail(ErrorCode::check_failed, "the correction does not converge: after " +
                                               std::to_string(out.steps) + " steps the tip is still " +
                                               shortest_text(out.left_mm) + " mm off");
    }
    ++out.steps;
    target_P -= error_P;
    if (!axis_done) {
      target_axis_P = (target_axis_P - (actual_pose.axis_P - axis_P)).normalized();
      turns = turn_rotaries(target_axis_P, state.q);
      sines = kinematics_.sines(state.q);
    }
    const JointVector before = state.q;
    kinematics_.solve_linear(target_P, sines, state.q);
    if (options_.orientation) continue;
    // The step takes off all but what the errors change on it.
    if (const auto left = course_.change_at_most(before, state.q); left && *left < options_.converged_mm) {
      out.left_mm = *left;
      break;
    }
  }
  out.aim_P = target_P - tip_P;
  out.q = state.q;
  return out;
}

}  // namespace trunnion::path
