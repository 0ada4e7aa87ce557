// uses_trunnion MACHINE.toml CONTROLLER.toml CL NC: the joints of a pose, there and back, and a CL file
// posted.
#include <cstdio>
#include <trunnion/machine/kinematics.hpp>
#include <trunnion/post/axes_of.hpp>
#include <trunnion/post/post_file.hpp>
#include <trunnion/report/post_json.hpp>

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  trunnion::Diagnostics diagnostics;
  const auto machine = trunnion::load_machine(argv[1], diagnostics);
  auto control = trunnion::nc::load_controller(argv[2], diagnostics);
  if (!machine || !control) return 3;
  *control = trunnion::post::with_axes_of(*machine, std::move(*control));

  trunnion::JointVector q;
  for (const auto id : machine->rotary_axes()) q[id] = 0.5;
  const auto pose = trunnion::tool_pose(trunnion::forward(*machine, q));
  const auto back = trunnion::inverse(*machine, pose, q);
  if (back.empty()) return 1;
  const auto again = trunnion::tool_pose(trunnion::forward(*machine, back.front().q));
  std::printf("there and back: %d\n", (again.tip_P - pose.tip_P).norm() < 1e-9 ? 1 : 0);

  trunnion::post::PostJob job;
  job.cl_file = argv[3];
  job.machine = &*machine;
  job.controller = &*control;
  const auto outcome = trunnion::post::post_file(job, {}, argv[4], false);
  std::printf("written and verified: %d\n", outcome.written && outcome.passed ? 1 : 0);
  return outcome.report && !trunnion::report::post_json(*outcome.report).empty() ? 0 : 1;
}
