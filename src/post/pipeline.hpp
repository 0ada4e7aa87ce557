#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "trunnion/nc/writer.hpp"
#include "trunnion/path/compensation.hpp"
#include "trunnion/post/post.hpp"

#include "post/feed_plan.hpp"
#include "post/offset_tracker.hpp"
#include "post/program_state.hpp"

namespace trunnion::post {

/// The stages joined, for one program: CL records in, NC text out. One object, one program.
class Pipeline {
 public:
  Pipeline(const PostJob& job, const PostOptions& options, const TextSink& sink, Diagnostics& diagnostics);
  ~Pipeline();

  Result<void> begin();
  Result<void> take(const cl::Record& record, const cl::Resolution& resolution);
  Result<PostReport> finish();

 private:
  /// A motion that waits for the end of its run, and what is said before it.
  struct Pending {
    path::ChoicePoint point;
    cl::Feed feed;
  };
  struct Event {
    std::size_t before = 0;  // index of the pending motion
    cl::Record record;
  };
  struct BeyondAxis {
    std::size_t count = 0;
    SourceRef first;
    LimitViolation worst;
    SourceRef where;  // of the worst
  };

  Result<void> flush_run();
  Result<void> emit_run(const std::vector<path::ChosenPoint>& chosen);
  Result<void> emit_segment(const path::Point& to, const Pending& motion);
  /// Where programmed points may be dropped or moved: the last of the cutting motions from `first` on that
  /// are one run (one feed, nothing said between them); `first` itself otherwise. `event` is the next one.
  std::size_t cutting_run_end(std::size_t first, std::size_t event,
                              const std::vector<path::ChosenPoint>& chosen) const;
  Result<void> emit_cutting_run(std::size_t first, std::size_t last,
                                const std::vector<path::ChosenPoint>& chosen);
  Result<void> emit_event(const cl::Record& record);
  Result<void> emit_spindle(const cl::Spindle& spindle, SourceRef where);
  Result<void> emit_tool_change(const cl::ToolChange& change);
  Result<void> emit_dwell(const cl::Dwell& dwell, SourceRef where);
  Result<void> emit_text(const cl::Text& text, SourceRef where);
  Result<void> take_tolerance(const cl::Tolerance& tolerance, SourceRef where);
  Result<void> emit_approach(const path::Point& to, const Pending& motion);
  Result<void> emit_safe_turn(const JointVector& q, SourceRef where);
  Result<void> emit_reconfiguration(const JointVector& next_q, const Pending& motion);
  Result<void> emit_feed_per_minute(const JointVector& q, double rate_mm_s, SourceRef where);
  Result<void> emit_rapid(const path::Point& to);
  Result<void> emit_feed(const path::Point& to, const cl::Feed& feed, SourceRef where, int depth);
  Result<void> emit_take_up(const path::Point& to, SourceRef where);
  bool bends(const path::Point& to, const JointVector& q) const;
  Result<void> emit_motion(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed, SourceRef where,
                           std::uint16_t only = 0xFFFF);
  JointVector part_words(const JointVector& q) const;
  Result<void> write(const nc::Block& block);
  Result<void> pass_on();
  /// Of the tip, mm/s; `segment_mm` is its way, for feeds given as an inverse time.
  Result<double> feed_rate(const cl::Feed& feed, double segment_mm, SourceRef where);
  /// Joint positions that go out for a nominal point: compensated when there is a model, checked against the
  /// limits.
  /// The machine has moved to `q` in `seconds`.
  void moved(const JointVector& q, double seconds);
  Result<JointVector> corrected(const path::Point& point, double seconds);
  JointVector expected(const JointVector& nominal) const;
  void check_limits(const path::Point& point, const JointVector& q);
  void note(const path::SegmentReport& report);
  path::Point rounded_point(const path::ChoicePoint& point, const JointVector& q) const;
  std::string limit_text(AxisId id) const;

  const PostJob& job_;
  const PostOptions& options_;
  const TextSink& sink_;
  Diagnostics& diagnostics_;
  const Machine& machine_;
  const nc::Controller& controller_;
  Vec3 tool_mm_;
  std::string text_;
  nc::Writer writer_;
  TableKinematics kinematics_;
  path::Rounding rounding_;
  path::Refiner refiner_;
  FeedPlanner planner_;
  path::Tolerance tolerance_;
  std::optional<path::Tolerance> rapid_tolerance_;
  std::array<nc::AxisLetter, kMaxAxes> letters_{};
  double spindle_rpm_ = 0.0;
  double tool_diameter_mm_ = 0.0;
  std::int64_t length_offset_ = 1;

  std::vector<Pending> pending_;
  std::vector<Event> events_;
  bool feed_seen_ = false;  // in the pending run: the next rapid ends it
  InverseOptions inverse_;

  bool placed_ = false;   // a first point was emitted
  bool approach_ = true;  // the next motion starts from an unknown or safe position
  path::Point last_;      // nominal, on the word grid
  JointVector last_emitted_;
  std::vector<path::Point> inserted_;
  std::vector<path::Point> run_;
  std::vector<path::SegmentReport> reports_;
  ProgramState state_;
  std::unique_ptr<ModelEvaluator> evaluator_;
  std::unique_ptr<path::Compensator> compensator_;
  std::optional<OffsetTracker> offsets_;
  std::unique_ptr<Verifier> verifier_;
  std::unique_ptr<Verifier> nominal_;
  std::array<BeyondAxis, kMaxAxes> beyond_;
  PostReport report_;
};

}  // namespace trunnion::post
