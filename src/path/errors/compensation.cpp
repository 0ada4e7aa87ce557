#include "trunnion/path/compensation.hpp"

#include <cmath>

#include "trunnion/base/number_text.hpp"

#include "path/errors/tool_turn.hpp"

namespace trunnion::path {

Compensator::Compensator(const Machine& machine, const Model& model, const Vec3& tool_mm,
                         const CompensationOptions& options)
    : machine_(machine),
      evaluator_(model),
      options_(options),
      kinematics_(machine, tool_mm),
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

// The tool axis, and the rotary axes in P where they stand at `sines`.
struct Compensator::ToolTurn {
  lanes::Triple<double> axis_P, outer_P, inner_P;

  ToolTurn(const TableKinematics& kinematics, const Vec3& axis, const RotarySines& sines)
      : axis_P(triple(axis)), inner_P(triple(kinematics.direction(1))) {
    outer_P = kinematics.turned_back(1, triple(kinematics.direction(0)),
                                     TableKinematics::SinesOf<double>{sines.sin, sines.cos});
  }
  static lanes::Triple<double> triple(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

  std::array<double, 2> towards(const Vec3& off) const {
    return turns_towards(triple(off), axis_P, outer_P, inner_P);
  }
  Vec3 moved_by(const std::array<double, 2>& turns) const {
    const auto by = turns[0] * lanes::cross(axis_P, outer_P) + turns[1] * lanes::cross(axis_P, inner_P);
    return {by.x, by.y, by.z};
  }
};

Result<Corrected> Compensator::corrected(const Vec3& tip_P, const Vec3& axis_P, const MachineState& at,
                                         std::span<const double> lagged, const Vec3& near) const {
  MachineState state = at;
  const RangeCheck range = evaluator_.check_range(state);
  if (range.verdict == RangeCheck::Verdict::refused) return fail(ErrorCode::check_failed, range.message);
  Corrected out;
  out.held = range.verdict == RangeCheck::Verdict::held;
  Vec3 target_P = tip_P + near;
  const bool turns_tool = options_.orientation && kinematics_.rotary_count() == 2;
  TableKinematics::Sines sines = kinematics_.sines(state.q);
  const ToolTurn turn(kinematics_, axis_P, sines);
  std::array<double, 2> turned{0.0, 0.0};
  kinematics_.solve_linear(target_P, sines, state.q);
  for (;;) {
    const ToolPose actual_pose = actual(state, sines, lagged);
    const Vec3 error_P = actual_pose.tip_P - tip_P;
    out.left_mm = error_P.norm();
    out.axis_P = actual_pose.axis_P;
    if (out.steps == 0) out.before_mm = (actual_pose.tip_P - target_P).norm();
    constexpr double kAxisConverged = 1e-10;  // rad: 0.1 nm at 1 m
    std::array<double, 2> step{0.0, 0.0};
    if (turns_tool) {
      // What the errors do there, less what the rotary axes have turned the tool by: to the first order of
      // a turn, the rest goes into the next step.
      const auto wanted = turn.towards(turn.moved_by(turned) - (actual_pose.axis_P - axis_P));
      for (std::size_t k = 0; k < 2; ++k) step[k] = wanted[k] - turned[k];
    }
    const bool axis_done = turn.moved_by(step).norm() < kAxisConverged;
    if (out.left_mm < kCorrected_mm && axis_done) break;
    constexpr int kMostSteps = 10;
    if (out.steps == kMostSteps) {
      return fail(ErrorCode::check_failed, "the correction does not converge: after " +
                                               std::to_string(out.steps) + " steps the tip is still " +
                                               shortest_text(out.left_mm) + " mm off, the tool axis " +
                                               shortest_text(turn.moved_by(step).norm()) + " rad");
    }
    ++out.steps;
    target_P -= error_P;
    if (!axis_done) {
      for (std::size_t k = 0; k < 2; ++k) {
        turned[k] += step[k];
        state.q[kinematics_.rotary(k)] = at.q[kinematics_.rotary(k)] + turned[k];
      }
      sines = kinematics_.sines(state.q);
    }
    const JointVector before = state.q;
    kinematics_.solve_linear(target_P, sines, state.q);
    if (turns_tool) continue;
    // The step takes off all but what the errors change on it.
    if (const auto left = course_.change_at_most(before, state.q); left && *left < kCorrected_mm) {
      out.left_mm = *left;
      break;
    }
  }
  out.aim_P = target_P - tip_P;
  out.q = state.q;
  return out;
}

}  // namespace trunnion::path
