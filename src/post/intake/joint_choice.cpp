#include "post/intake/joint_choice.hpp"

#include <optional>
#include <utility>

#include "post/making/post_words.hpp"

namespace trunnion::post {

JointChoice::JointChoice(const PostJob& job, const PostOptions& options, const PathTolerances& tolerances,
                         const SpindleTool& tool, const JointVector& quantum)
    : job_(job),
      options_(options),
      tolerances_(tolerances),
      machine_(*job.machine),
      tool_(tool),
      rounding_(path::Rounding::of(machine_, tool.in_words(), quantum)),
      kinematics_(machine_, tool.vector()),
      solver_(machine_),
      method_(options.choice),
      axis_(options.choice_axis) {}

void JointChoice::set_tool(const SpindleTool& tool) {
  tool_ = tool;
  kinematics_ = TableKinematics(machine_, tool.vector());
  rounding_ = path::Rounding::of(machine_, tool.in_words(), rounding_.quantum);
}

path::ChoiceOptions JointChoice::options() const {
  path::ChoiceOptions out;
  out.method = method_;
  out.axis = axis_;
  out.inverse = inverse_;
  out.tool_mm = tool_.vector();
  out.axis_tolerance = tolerances_.cutting().axis_room();
  return out;
}

bool JointChoice::settles(const ToolPose& pose) const {
  return path::settles_choice(machine_, solver_, pose, options());
}

void JointChoice::end_at(const path::ChoicePoint& point, const JointVector& q_leave) {
  last_ = rounded(point, q_leave);
  has_last_ = true;
}

Result<void> JointChoice::choose(Chunk& chunk) {
  const path::ChoiceSummary so_far = summary_;
  if (auto done = choose_points(chunk); !done) return done;
  if (options_.pole.tolerance.rad() > 0.0) {
    if (auto done = tilt_near_pole(chunk, so_far); !done) return done;
  }
  end_at(chunk.points.back(), chunk.chosen.back().q_leave);
  return {};
}

Result<void> JointChoice::choose_points(Chunk& chunk) {
  return path::choose_solutions(machine_, {chunk.points, last_.q, job_.cl_file}, options(), chunk.chosen,
                                summary_);
}

// Again, with the tool axes that may be led through the pole.
Result<void> JointChoice::tilt_near_pole(Chunk& chunk, const path::ChoiceSummary& so_far) {
  const path::PoleOptions& pole = options_.pole;
  std::optional<path::PoleStart> from;
  if (has_last_) from = path::PoleStart{last_.q, kinematics_.pose(last_.q)};
  if (!path::turns_near_pole(machine_, pole, chunk.points, chunk.chosen, from)) return {};
  const std::vector<path::ChoicePoint> programmed = chunk.points;
  for (const path::ChoicePoint& point : programmed) chunk.programmed_axes_P.push_back(point.pose.axis_P);
  const std::vector<path::ChosenPoint> before = std::exchange(chunk.chosen, {});
  chunk.points = path::put_on_pole(machine_, pole, programmed);
  summary_ = so_far;
  if (auto done = choose_points(chunk); !done) return done;
  chunk.pole = path::tilt_near_pole(machine_, tool_.vector(), pole, options().axis_tolerance,
                                    {programmed, before, chunk.points, chunk.chosen, from});
  return {};
}

// The pipeline does the rest, and tells what it cannot do.
JointChoice::Change JointChoice::take(const cl::PostWord& word) {
  if (word.word == "LIMITS") {
    std::string cut;
    take_limits(word, *job_.machine, machine_, cut);
    solver_ = RotarySolver(machine_);
    return Change::none;
  }
  if (stands_at(word, machine_, last_.q)) return Change::place;
  if (const auto measure = measure_of(word, machine_)) {
    method_ = measure->method;
    axis_ = measure->axis;
    return Change::none;
  }
  const auto turn = table_turn_of(word, machine_, last_.q);
  if (!turn || !machine_.axes[turn->axis].within_limits(turn->angle)) return Change::none;
  last_.q[turn->axis] = rounding_.rounded(turn->axis, turn->angle);
  return Change::turn;
}

}  // namespace trunnion::post
