#pragma once
#include "trunnion/post/post.hpp"

#include "post/feeds/feed_plan.hpp"
#include "post/intake/chunk_in_work.hpp"
#include "post/intake/path_modes.hpp"
#include "post/judging/block_course.hpp"
#include "post/machine_errors.hpp"
#include "post/making/cutter_wear.hpp"
#include "post/making/joint_words.hpp"
#include "post/making/posting.hpp"
#include "post/making/servo_lead.hpp"
#include "post/making/spindle_and_coolant.hpp"
#include "post/making/thermal_output.hpp"
#include "post/making/tilted_planes.hpp"
#include "post/making/tool_place.hpp"
#include "post/tools/tool_in_spindle.hpp"

namespace trunnion::post {

/// The program as far as its text is made: what all that make parts of it share, and leave to each other.
struct ProgramInWork {
  ProgramInWork(const PostJob& job, const PostOptions& options);

  /// From here on motions are made with this tool.
  void set_tool(const SpindleTool& to);
  /// Words are coordinates of the part or of a plane on it, not of the machine.
  bool in_part() const { return posting.options.rtcp || planes.in_force().has_value(); }
  bool same_rotary(const JointVector& a, const JointVector& b) const;
  path::Point rounded(const path::ChoicePoint& point, const JointVector& q) const {
    return rounded_point(tool.kinematics, axis_words.rounding(), point, q);
  }
  /// Time passes, `pause` without a motion.
  void elapse(double seconds);
  void pause(double seconds);
  /// The machine has moved to `q` in `seconds`.
  void moved(const JointVector& q, double seconds);

  Posting posting;
  ToolInSpindle tool;
  JointWords axis_words;
  FeedPlanner planner;
  PathModes modes;
  CutterWear cutter;
  TiltedPlanes planes;
  ChunkInWork now;
  ToolPlace at;
  MachineErrors errors;
  BlockCourse course;
  SpindleAndCoolant spindle;
  ThermalOutput thermal;
  ServoLead lead;
};

}  // namespace trunnion::post
