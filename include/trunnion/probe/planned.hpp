#pragma once
#include <string>
#include <vector>

#include "trunnion/diagnosis/plan.hpp"

namespace trunnion::probe {

/// What one run of a measuring plan asks of a ball and a stylus.
struct PlannedBall {
  Vec3 place_P = Vec3::Zero();     // its centre, mm
  std::vector<JointVector> poses;  // rotary axes, each once
  double stylus_length_mm = 0.0;   // of the plan's tool
  bool both_directions = false;    // every pose twice, from either sense of the rotary axes
};

/// The ball of a run as `model plan` writes it: displacements at one place of the part, from several
/// positions of the rotary axes. Fails with wrong_input, naming the run and `file`, where it is another
/// measurement (a laser, a circle, a tool that does not point along the spindle).
Result<PlannedBall> planned_ball(const diagnosis::PlanRun& run, const Machine& machine,
                                 const std::string& file);

}  // namespace trunnion::probe
