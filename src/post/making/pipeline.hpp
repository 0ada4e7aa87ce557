#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "trunnion/path/compensation.hpp"
#include "trunnion/post/plane_frame.hpp"
#include "trunnion/post/post.hpp"

#include "post/feeds/feed_plan.hpp"
#include "post/intake/chunk_in_work.hpp"
#include "post/intake/intake.hpp"
#include "post/intake/path_modes.hpp"
#include "post/judging/block_course.hpp"
#include "post/machine_errors.hpp"
#include "post/making/cutter_wear.hpp"
#include "post/making/joint_words.hpp"
#include "post/making/posting.hpp"
#include "post/making/program_head.hpp"
#include "post/making/spindle_and_coolant.hpp"
#include "post/making/thermal_output.hpp"
#include "post/making/tilted_planes.hpp"
#include "post/making/tool_place.hpp"
#include "post/prepare/refinement.hpp"
#include "post/tools/tool_in_spindle.hpp"

namespace trunnion::post {

/// The stage that makes the NC text of one program: prepared chunks in, in their order, their text out.
class Pipeline {
 public:
  Pipeline(const PostJob& job, const PostOptions& options);

  Result<void> begin();
  /// Makes the NC text of a prepared chunk, and puts it there.
  Result<void> emit(Chunk& chunk);
  /// The end of the program: the text that is left is put into `end`.
  Result<void> finish(const Intake& intake, Chunk& end);
  /// Of the finished text, but for its verification. Fails with check_failed when a position is beyond the
  /// travel.
  Result<PostReport> report();
  const Diagnostics& diagnostics() const { return posting_.diagnostics; }

  /// Of the words, as path::Rounding has it.
  const JointVector& quantum() const { return axis_words_.rounding().quantum; }
  /// Of the machine, or null.
  const ModelEvaluator* errors() const { return errors_.evaluator.get(); }
  /// Where the errors hang on the position alone; else null.
  const path::Compensator* compensator_by_place(const SpindleTool& tool) const {
    return errors_.by_place ? &errors_.compensators->of(tool.length_mm) : nullptr;
  }

 private:
  static constexpr std::uint16_t kAllWords = 0xFFFF;
  /// Halvings of one piece for the bend of the errors: beyond this the errors change faster than any
  /// machine's.
  static constexpr int kMaxBends = 6;

  /// The head of the program, when its first motions and what is said before them are known.
  Result<void> begin_text(const Chunk& chunk);
  Result<void> clamp_standing();
  /// Time passes, `pause` without a motion.
  void elapse(double seconds);
  void pause(double seconds);

  /// From here on motions are made with this tool.
  void set_tool(const SpindleTool& tool);
  Result<void> emit_run();
  /// The tilted plane in which the chunk is to be written, when it is one of its kind.
  void choose_plane();
  void tell_notes();
  /// Words for the post-processor that the intake does not act on alone.
  Result<void> take_post_word(const cl::PostWord& word, SourceRef where);
  /// To the safe height: what follows comes from there.
  Result<void> leave_part(SourceRef where);
  Result<void> turn_table(AxisId id, double angle, bool now, SourceRef where);
  Result<void> emit_segment(const path::Point& to, const Pending& motion, const PreparedSegment* prepared);
  void begin_segment(const path::Point& from, const path::Point& to);
  /// The one that ends at motion `i` of the chunk.
  void begin_segment(std::size_t i);
  bool is_plain() const;
  Result<std::size_t> emit_plain(std::size_t first, std::size_t end);
  struct PlainRun;
  std::size_t add_kept(PlainRun& run, std::size_t i, std::size_t end, double feed_mm_s) const;
  Result<void> add_plain(PlainRun& run, std::size_t i);
  std::size_t add_known(PlainRun& run, std::size_t i, std::size_t end, double feed_mm_s);
  bool goes_on(std::size_t i, double feed_mm_s) const;
  /// Motion `i` turns the axes by its correction alone.
  bool turns_idly(std::size_t i, const JointVector& from, const JointVector& to) const;
  const JointVector* known_correction(std::size_t number) const;
  Result<void> add_corrected(PlainRun& run, const path::Point& to, const Vec3& tip_P, std::size_t i,
                             std::size_t number);
  path::Point point_of(const FeedPlanner::Stop& stop, std::size_t i) const;
  Result<void> emit_plain_run(PlainRun& run);
  std::size_t write_plain_run(const PlainRun& run, std::size_t done);
  Result<void> emit_plain_block(const PlainRun& run, std::size_t block);
  Result<void> emit_to(const path::Point& point, const Pending& motion);
  /// The segment to motion `i` of the chunk, where it was prepared for what the pipeline is about to do.
  const PreparedSegment* prepared(std::size_t i) const;
  /// Where programmed points may be dropped or moved: the last of the cutting motions from `first` on that
  /// are one run (one feed, nothing said between them); `first` itself otherwise. `event` is the next one.
  std::size_t cutting_run_end(std::size_t first, std::size_t event) const;
  Result<void> emit_cutting_run(std::size_t first, std::size_t last);
  /// An arc or a hole whose motions begin with number `i`, in the control's own words; false where those
  /// cannot hold it: then its motions go out.
  Result<bool> emit_shape(const cl::Shape& shape, std::size_t i);
  Result<nc::Thread> thread_of(const cl::Hole& hole, SourceRef where);
  /// Why a tap is not written.
  std::string no_tap(const cl::Hole& hole) const;
  /// The tool over the hole at `height`; the words where it then stands.
  Result<nc::AxisWords> rise_over(const cl::Hole& hole, double height_mm, const path::Point& end);
  bool may_be_shape(std::size_t i, std::size_t count) const;
  Result<bool> emit_arc(const cl::Arc& arc, std::size_t i, std::size_t count);
  Result<bool> emit_hole(const cl::Hole& hole, std::size_t i, std::size_t count);
  Result<void> emit_across(const cl::Hole& hole, std::size_t i, bool cycle_goes);
  double emit_rate(double rate_mm_s, double length_mm, std::int64_t& feed);
  double seconds_of(const nc::Hole& hole, const JointVector& at) const;
  static bool holds_word(const nc::Template& words, const char* word);
  bool same_rotary(const JointVector& a, const JointVector& b) const;
  Vec3 word_xyz(const Vec3& tip_P, const JointVector& at) const;
  Vec3 xyz_of(const JointVector& words) const;
  nc::AxisWords quanta_of(const Vec3& xyz_mm) const;
  JointVector joints_of_xyz(const nc::AxisWords& words, const JointVector& at) const;
  /// Failures name the line of the CL file.
  Result<void> emit_event(const cl::Record& record);
  Result<void> emit_event_at(const cl::Record& record);
  Result<void> emit_spindle(const cl::Spindle& spindle, SourceRef where);
  Result<void> emit_coolant(nc::CoolantKind kind);
  Result<void> emit_stop(const cl::Stop& stop, SourceRef where);
  Result<void> emit_tool_change(const cl::ToolChange& change, SourceRef where);
  Result<void> emit_cutter_compensation(const cl::CutterCompensation& c, SourceRef where);
  /// What a control asks of motion number `i` while it compensates.
  Result<void> check_compensated(std::size_t i);
  Result<void> emit_dwell(const cl::Dwell& dwell, SourceRef where);
  Result<void> emit_text(const cl::Text& text, SourceRef where);
  Result<void> take_tolerance(const cl::Tolerance& tolerance, SourceRef where);
  Result<void> emit_retract(SourceRef where);
  Result<void> write_retract(nc::AxisLetter letter, double position_mm);
  /// To the safe height, from where the tool comes back if the program cuts on.
  Result<void> emit_pause_above(SourceRef where);
  Result<void> emit_return(const Pending& motion);
  Result<void> emit_end();
  Result<void> emit_approach(const path::Point& to, const Pending& motion);
  Result<void> emit_safe_turn(const JointVector& q, SourceRef where);
  JointVector above(const JointVector& q) const;
  /// On the way to `next`, the position of `motion`, the rotary axes turn away from the part where they must.
  /// True when the tool is there already.
  Result<bool> emit_reconfiguration(const path::ChosenPoint& next, const Pending& motion);
  /// Before `motion`: the turn that was due at the end of the one before.
  Result<void> emit_waiting_turn(const Pending& motion);
  Result<void> emit_turn_away(const JointVector& after, const Pending& motion);
  Result<void> emit_feed_per_minute(const JointVector& q, double rate_mm_s, SourceRef where);
  Result<void> emit_rapid(const path::Point& to);
  /// Over the safe height: on its straight way the tip would circle the part.
  Result<void> emit_rapid_above(const path::Point& to);
  Result<void> emit_feed(const path::Point& to, const cl::Feed& feed, SourceRef where, int depth);
  /// From where `q` is found on: `rate_mm_s` that of the tip.
  Result<void> emit_corrected(const path::Point& to, JointVector q, double rate_mm_s, const cl::Feed& feed,
                              SourceRef where, int depth);
  double lost_turn(const MachineState& at, AxisId id, std::int8_t sense) const;
  void hold_idle_turns(JointVector& q) const;
  /// Before the motion to `q`: true when a block went out that takes up lost motion.
  Result<bool> emit_take_up(const JointVector& q, SourceRef where);
  bool rewinds(const path::Point& to, const JointVector& q) const;
  bool bends(const path::Point& to, const JointVector& q, bool bounded = false);
  bool stays_surely(const path::Point& to, const JointVector& q, double limit_mm, bool bounded);
  bool lasts_long(const JointVector& q, double tip_mm, double rate) const;
  bool span_bends(const path::Point& to, const JointVector& q) const;
  /// What a piece over several segments leaves of the tolerance to the errors.
  path::Tolerance span_tolerance() const;
  path::Point middle_before(const path::Point& to) const;
  double strays_mm(const path::Point& to, const JointVector& q, double t) const;
  /// With the machine's errors, at the fraction t of the block to `q`.
  Vec3 actual_tip_P(const JointVector& q, double t) const;
  std::optional<JointVector> without_idle_digits(const path::Point& to, const JointVector& q) const;
  /// The motion from the last emitted position to `q`, for the planner.
  FeedPlanner::Move move_to(const JointVector& q, double tip_mm) const;
  /// X Y Z words of `q` under tool-centre-point control, rounded: the tip in P, mm.
  Vec3 word_tip_P(const JointVector& q) const;
  JointVector words(const JointVector& q) const;
  Result<void> write_plain(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed, SourceRef where);
  Result<void> emit_motion(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed, SourceRef where,
                           std::uint16_t only = kAllWords);
  /// Words are coordinates of the part or of a plane on it, not of the machine.
  bool in_part() const { return posting_.options.rtcp || planes_.in_force().has_value(); }
  JointVector part_words(const JointVector& q) const;
  void round_joints(JointVector& q) const;
  /// Of the tip, mm/s; `segment_mm` is its way, for feeds given as an inverse time.
  Result<double> feed_rate(const cl::Feed& feed, double segment_mm, SourceRef where);
  /// The machine has moved to `q` in `seconds`.
  void moved(const JointVector& q, double seconds);
  /// Joint positions that go out for a nominal point: compensated when there is a model, checked against the
  /// limits.
  Result<JointVector> corrected(const path::Point& point, double seconds);
  /// The rotary axes put the tool axis right, the linear ones the tip for it: `at.q`.
  Result<void> turn_for_errors(const path::Point& point, const Vec3& tip_P, MachineState& at);
  /// Neither the prescribed tool axis nor the nominal rotary axes turn on the way to this point, and the
  /// tool's direction is corrected.
  bool axis_stands(const path::Point& to) const;
  /// The correction with the senses of motion that it leads to itself; those of `at` do not count.
  Result<path::Corrected> compensated(const Vec3& tip_P, const Vec3& axis_P, MachineState at) const;
  JointVector expected(const JointVector& nominal) const;
  void note(const path::SegmentReport& report);
  path::Point rounded(const path::ChoicePoint& point, const JointVector& q) const {
    return rounded_point(tool_.kinematics, axis_words_.rounding(), point, q);
  }

  Posting posting_;
  ToolInSpindle tool_;
  JointWords axis_words_;
  Refinement refined_;
  FeedPlanner planner_;
  PathModes modes_;
  CutterWear cutter_;
  TiltedPlanes planes_;
  ProgramHead head_;

  ChunkInWork now_;
  ToolPlace at_;
  MachineErrors errors_;
  BlockCourse course_;
  SpindleAndCoolant spindle_;
  ThermalOutput thermal_;
};

}  // namespace trunnion::post
