#pragma once
#include <memory>
#include <vector>

#include "post/making/posting.hpp"
#include "post/prepare/compensators.hpp"
#include "post/program_state.hpp"
#include "post/tools/spindle_tool.hpp"

namespace trunnion::post {

/// The errors of the machine that the text answers; without a model there are none.
struct MachineErrors {
  explicit MachineErrors(const PostJob& job)
      : state(job.machine->axes.size(),
              job.model != nullptr ? lag_requests(*job.model) : std::vector<LagRequest>{}, job.temperatures) {
    if (job.model == nullptr) return;
    evaluator = std::make_unique<ModelEvaluator>(*job.model);
    compensators = std::make_unique<Compensators>(*job.machine, *job.model);
    lose_motion = evaluator->depends_on() >= DependsOn::motion;
    know_history = evaluator->depends_on() > DependsOn::position;
  }
  void set_tool(const SpindleTool& tool) {
    if (!compensators) return;
    compensator = &compensators->of(tool.length_mm);
    turner = tool.flute_mm > 0.0 ? &compensators->turning(tool.length_mm) : nullptr;
  }

  ProgramState state;  // of the machine at the end of the text so far
  std::unique_ptr<ModelEvaluator> evaluator;
  std::unique_ptr<Compensators> compensators;
  const path::Compensator* compensator = nullptr;  // of the tool at hand
  const path::Compensator* turner = nullptr;       // of the tool's direction; null where its tip counts alone
  bool lose_motion = false;                        // some hang on the sense of motion
  bool know_history = false;                       // some hang on more than the position
  Vec3 aim_P = Vec3::Zero();                       // path::Corrected::aim_P of the last point
  bool by_place = false;  // all hang on the position alone, and blocks can be written in runs
};

}  // namespace trunnion::post
