#include "post/making/program_in_work.hpp"

#include <algorithm>
#include <vector>

namespace trunnion::post {

ProgramInWork::ProgramInWork(const PostJob& job, const PostOptions& options)
    : posting(job, options),
      tool(posting, {options.tools.length_mm.value_or(posting.machine.tool_length_mm)}),
      axis_words(posting, tool.tool),
      planner(posting.machine, posting.controller, options.feed),
      modes{PathTolerances(job, options), {}},
      planes(posting),
      errors(job),
      spindle(posting),
      thermal(posting),
      lead(posting.machine, job.lag_s, options.tolerance_mm) {
  set_tool(tool.tool);
  errors.by_place = errors.compensator != nullptr && axis_words.fill_runs() && course.meter().is_fixed() &&
                    !errors.lose_motion && !errors.know_history;
}

void ProgramInWork::set_tool(const SpindleTool& to) {
  tool.set(posting, to);
  axis_words.set_tool(to);
  errors.set_tool(to);
  modes.tolerances.set_flute(to.flute_mm);
  if (errors.compensator == nullptr && !thermal.has_offsets()) return;
  const DeviationMeter::Errors of{errors.evaluator.get(), thermal.followed()};
  const DeviationMeter::Limits limits{posting.options.tolerance_mm,
                                      posting.options.axis_tolerance.value_or(posting.machine.axis_tolerance),
                                      posting.options.nonlinear.certify};
  course.set_meter(errors.state, posting.machine, to.vector(), of, limits);
}

bool ProgramInWork::same_rotary(const JointVector& a, const JointVector& b) const {
  for (AxisId id = 0; id < posting.machine.axes.size(); ++id) {
    if (posting.machine.axes[id].kind == AxisKind::rotary && a[id] != b[id]) return false;
  }
  return true;
}

void ProgramInWork::elapse(double seconds) {
  posting.report.duration_s += seconds;
  thermal.advance(seconds);
}

void ProgramInWork::pause(double seconds) {
  errors.state.wait(seconds);
  elapse(seconds);
}

void ProgramInWork::moved(const JointVector& q, double seconds) {
  if (!errors.know_history) return elapse(seconds);
  const auto lagged = errors.state.lagged();
  const std::vector<double> before(lagged.begin(), lagged.end());
  errors.state.move_to(q, seconds);
  elapse(seconds);
  if (before.empty()) return;
  const Vec3 tip_before = errors.compensator->actual(errors.state.now(), before).tip_P;
  const Vec3 tip_after = errors.compensator->actual(errors.state.now(), errors.state.lagged()).tip_P;
  posting.report.lag_step_mm = std::max(posting.report.lag_step_mm, (tip_after - tip_before).norm());
}

}  // namespace trunnion::post
