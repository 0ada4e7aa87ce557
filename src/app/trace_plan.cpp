#include "app/trace_plan.hpp"

#include "trunnion/base/files.hpp"
#include "trunnion/post/cl_points.hpp"
#include "trunnion/post/plan_of_control.hpp"

namespace trunnion::app {
namespace {

// What accelerating adds to each block; what a corner adds stands with the block behind it.
void add_accelerations(std::optional<MotionPlan> control, trace::Plan& plan) {
  if (!control) return;
  std::vector<trace::PlannedBlock*> added;
  const trace::PlannedBlock* before = nullptr;
  for (trace::PlannedBlock& block : plan.blocks) {
    // Where nobody knows the way it mostly goes on from a rapid into a retract.
    if (before != nullptr && before->dwell_s > 0.0)
      control->stop();
    else if (block.unknown)
      control->lose();
    if (before != nullptr && !block.unknown && block.seconds > 0.0) {
      control->add({before->q, block.q, block.seconds, block.rapid});
      added.push_back(&block);
    }
    before = &block;
  }
  control->stop();
  std::vector<BlockRun> runs;
  control->settle(added.size(), runs);
  for (std::size_t i = 0; i < runs.size(); ++i) added[i]->more_s = runs[i].seconds - added[i]->seconds;
}

}  // namespace

Result<trace::Plan> plan_of(const TracedProgram& program) {
  const Machine& machine = program.files.machine;
  trace::Plan plan;
  plan.tolerance_mm = program.options.tolerance_mm;
  plan.axis_tolerance_rad = program.options.axis_tolerance.rad();
  auto path = program.against.open();
  if (!path) return tl::unexpected(path.error());
  Diagnostics said_before;  // when the program was verified
  const auto points =
      post::cl_points(std::move(*path), {program.options.tolerance_mm, program.options.axis_tolerance},
                      program.options.tools, said_before);
  if (!points) return tl::unexpected(points.error());
  for (const post::ClPoint& p : *points)
    plan.path.push_back({p.tip_P, p.axis_P, p.flute_mm, p.line, p.rapid});
  plan.blocks.reserve(program.report.blocks.size());
  for (const post::VerifiedBlock& b : program.report.blocks)
    plan.blocks.push_back(
        {b.q, b.length_mm, b.seconds, 0.0, b.dwell_s, b.nc_line, b.cl_line, b.rapid, b.tcp, b.unknown});
  add_accelerations(post::plan_of_control(machine, program.files.controller, program.options.smoothing_mm,
                                          PlanOf::paces_and_seconds),
                    plan);
  if (const ModelEvaluator* truth = program.options.truth; truth != nullptr) {
    const Vec3 datum_P = datum_shift_P(machine, *truth);
    plan.pose = [&machine, truth, datum_P](const JointVector& q, const Vec3& tool_mm) {
      MachineState state;
      state.q = q;
      ToolPose pose = tool_pose(forward(machine, q, tool_mm, truth->errors(state)));
      pose.tip_P -= datum_P;
      return pose;
    };
  }
  return plan;
}

Result<trace::Trace> load_trace(const std::string& file, const Machine& machine, Diagnostics& diagnostics) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  return trace::parse_trace(*text, file, machine, diagnostics);
}

}  // namespace trunnion::app
