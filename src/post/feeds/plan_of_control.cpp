#include "trunnion/post/plan_of_control.hpp"

#include "trunnion/machine/motion_time.hpp"

namespace trunnion::post {

std::optional<MotionPlan> plan_of_control(const Machine& machine, const nc::Controller& controller,
                                          std::optional<double> smoothing_mm, PlanOf what) {
  if (!MotionTime::is_known(machine)) return std::nullopt;
  // A control that says nothing of it goes on from block to block: G64 and the like are what it begins with.
  const auto mode = controller.default_path_mode.value_or(
      controller.feed.looks_ahead ? nc::PathModeKind::continuous : nc::PathModeKind::exact_path);
  BlockEnds ends;
  ends.stops = !smoothing_mm && mode != nc::PathModeKind::continuous;
  // 0: as the control has it set, which nobody knows here.
  if (smoothing_mm && *smoothing_mm > 0.0) ends.blend_mm = smoothing_mm;
  ends.looks_ahead = controller.feed.looks_ahead;
  JointVector digits;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (const auto letter = nc::axis_letter(machine.axes[id].name))
      digits[id] = controller.numbers.axes.quantum(*letter);
  }
  return MotionPlan(machine, ends, digits, what);
}

}  // namespace trunnion::post
