#pragma once
#include <string>
#include <vector>

#include "trunnion/machine/rotary_solver.hpp"
#include "trunnion/path/solution_choice.hpp"

#include "post/intake/chunk.hpp"
#include "post/intake/path_tolerances.hpp"

namespace trunnion::post {

/// The choice of the joints, run by run: with what (machine as LIMITS leaves it, tool, measure), from where,
/// and how it went so far.
class JointChoice {
 public:
  /// `quantum`: of the words, as path::Rounding has it. `tolerances` must outlive the choice.
  JointChoice(const PostJob& job, const PostOptions& options, const PathTolerances& tolerances,
              const SpindleTool& tool, const JointVector& quantum);

  void set_tool(const SpindleTool& tool);
  /// Of the tool axes of the CL file.
  void set_resolution(const cl::Resolution& resolution) { inverse_.axis_resolution = resolution.axis; }
  /// Whether the run goes on behind the next points, or these end it.
  void set_goes_on(bool goes_on) { summary_.goes_on = goes_on; }
  /// What a word for the post-processor changes for the motions behind it.
  enum class Change : std::uint8_t { none, place, turn };
  Change take(const cl::PostWord& word);

  /// The joints of all motions of the chunk; `last` is then where they end.
  Result<void> choose(Chunk& chunk);
  /// Nothing behind this pose can change what is chosen before it.
  bool settles(const ToolPose& pose) const;
  /// The run ends at this point with these joints.
  void end_at(const path::ChoicePoint& point, const JointVector& q_leave);
  path::Point rounded(const path::ChoicePoint& point, const JointVector& q) const {
    return rounded_point(kinematics_, rounding_, point, q);
  }
  path::ChoiceOptions options() const;

  const Machine& machine() const { return machine_; }
  path::ChoiceMethod method() const { return method_; }
  const InverseOptions& inverse() const { return inverse_; }
  /// The last point handed on, where there is one.
  const path::Point& last() const { return last_; }
  bool has_last() const { return has_last_; }
  path::ChoiceSummary& summary() { return summary_; }
  const path::ChoiceSummary& summary() const { return summary_; }

 private:
  Result<void> choose_points(Chunk& chunk);
  Result<void> tilt_near_pole(Chunk& chunk, const path::ChoiceSummary& so_far);

  const PostJob& job_;
  const PostOptions& options_;
  const PathTolerances& tolerances_;
  Machine machine_;
  SpindleTool tool_;
  path::Rounding rounding_;
  TableKinematics kinematics_;
  RotarySolver solver_;        // of machine_
  path::ChoiceMethod method_;  // as ROTABL/SHORT leaves it
  std::string axis_;
  InverseOptions inverse_;
  path::Point last_;
  bool has_last_ = false;
  path::ChoiceSummary summary_;
};

}  // namespace trunnion::post
