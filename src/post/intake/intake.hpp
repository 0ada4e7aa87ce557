#pragma once
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "trunnion/machine/rotary_solver.hpp"
#include "trunnion/path/held_run.hpp"
#include "trunnion/post/post.hpp"

#include "post/intake/chunk.hpp"

namespace trunnion::post {

/// Tolerances of the path as the options and the words of the CL file (LINTOL) have them. On a machine with
/// errors a share of the tool axis' tolerance is left to them: five axes correct the tip and the direction of
/// the tool at the points, and nothing between them.
class PathTolerances {
 public:
  PathTolerances(const PostJob& job, const PostOptions& options);
  void take(const cl::Tolerance& word);
  /// The tolerance of the path holds up to here along the tool; 0: for its tip alone.
  void set_flute(double length_mm);
  const path::Tolerance& cutting() const { return cutting_; }
  /// Of the tip of a cut, as the options and LINTOL ask for it.
  double tolerance_mm() const { return asked_mm_; }
  /// Of rapids only the tip is held to its line.
  const path::Tolerance& rapid() const { return rapid_; }

 private:
  const PostOptions& options_;
  double axis_share_;
  Angle axis_given_;
  double tip_share_;
  double tip_given_mm_;
  double word_error_mm_;  // of the tip's own words, which are rounded behind the insertion
  double flute_share_;
  double asked_mm_;
  double turn_error_;  // by which the rounding of the rotary words turns a corrected tool, rad
  path::Tolerance cutting_;
  double rapid_given_mm_;
  path::Tolerance rapid_;
};

/// First stage: gathers the records of the CL file into chunks and chooses the joints of their motions. A
/// chunk ends where nothing that follows can change the choice: before the rapid that begins a new run, at a
/// tool change, and within a long run behind a point that one position only reaches. A long run in which
/// there is no such point is held to its end, packed, and goes on in pieces.
class Intake {
 public:
  /// `quantum`: of the words, as path::Rounding has it. `store` must outlive the intake.
  Intake(const PostJob& job, const PostOptions& options, const JointVector& quantum, ChunkStore& store);

  /// Takes the next record; gives a chunk when one is complete.
  std::unique_ptr<Chunk> take(const cl::Record& record, const cl::Resolution& resolution);
  /// As `take` for so many motions at most, none of which is a rapid.
  static constexpr std::size_t kMostCuts = 32;
  std::size_t cuts_taken() const;
  std::unique_ptr<Chunk> take(std::span<const cl::PlainCut> cuts, const cl::Feed& feed,
                              const cl::Resolution& resolution);
  /// Of a long run that was chosen as a whole the next piece, before anything else is taken; null: none.
  std::unique_ptr<Chunk> next_piece();
  /// What is left at the end of the file.
  std::unique_ptr<Chunk> finish() { return flush(); }

  std::size_t points() const { return points_; }
  const path::ChoiceSummary& choice() const { return summary_; }
  const ProgramTools& tools() const { return tools_; }

 private:
  std::unique_ptr<Chunk> flush();
  std::unique_ptr<Chunk> fresh();
  bool may_hold() const;
  void begin_to_hold();
  void hold(const Pending& motion);
  void hold_feed(const cl::Feed& feed, bool step);
  void hand_to_held();
  void hold_where_long();
  std::unique_ptr<Chunk> flush_held();
  void take_held(std::size_t count, Chunk& piece);
  std::size_t end_of_piece() const;
  /// Motions of the present run.
  bool run_is_empty() const { return chunk_->motions.empty() && !held_; }
  const ToolPose& last_pose() const {
    if (!held_) return chunk_->motions.back().point.pose;
    return choice_points_.empty() ? held_last_.pose : choice_points_.back().pose;
  }
  std::size_t run_size() const {
    return held_ ? held_->size() + choice_points_.size() : chunk_->motions.size();
  }
  bool may_divide(const Chunk& chunk) const;
  Result<void> choose(Chunk& chunk);
  void take_post_word(const cl::PostWord& word);
  /// The chunk that ends at a tool change.
  std::unique_ptr<Chunk> take_tool(const cl::ToolChange& change, SourceRef where);
  /// Before the first motion of a file that has loaded no tool. False: it must, and the chunk has failed.
  bool begin_without_tool(SourceRef where);
  void set_tool(const SpindleTool& tool);
  std::unique_ptr<Chunk> take_cutter(const cl::ToolGeometry& cutter);
  /// Before anything is taken: the tool that was changed for.
  void take_next_tool() {
    if (coming_.tool) set_tool(*std::exchange(coming_.tool, std::nullopt));
  }
  bool may_cut(const ToolPose& pose) const;
  path::ChoiceOptions choice_options() const;

  const PostJob& job_;
  const PostOptions& options_;
  Machine machine_;  // as LIMITS leaves it
  ProgramTools tools_;
  SpindleTool tool_;
  /// Of the tool that comes next.
  struct Coming {
    FluteLength flute;                // of the one whose words were read last
    std::optional<SpindleTool> tool;  // behind what is still handed on of the run before
  };
  Coming coming_;
  bool tool_known_ = false;  // a tool was loaded, or nothing asks for one
  path::Rounding rounding_;
  ChunkStore& store_;
  TableKinematics kinematics_;
  RotarySolver solver_;  // of machine_
  PathTolerances tolerances_;
  path::ChoiceMethod method_;  // as ROTABL/SHORT leaves it
  std::string axis_;
  InverseOptions inverse_;
  path::Point last_;  // the last point handed on
  bool has_last_ = false;
  std::unique_ptr<Chunk> chunk_;
  std::unique_ptr<path::HeldRun> held_;  // the present run, where it is held, up to choice_points_
  /// What a held run says beside its points, where it changes.
  struct HeldFeed {
    std::size_t motion = 0;
    cl::Feed feed;
    bool step = false;
  };
  std::vector<HeldFeed> held_feeds_;
  path::ChoicePoint held_last_;
  std::unique_ptr<Chunk> whole_;           // a run that goes on in pieces
  std::unique_ptr<path::HeldRun> unheld_;  // its motions, where they were held
  std::size_t whole_size_ = 0;
  std::size_t piece_begin_ = 0;  // of its motions, the next piece
  std::size_t piece_event_ = 0;  // the first of its events that is not handed on
  std::size_t held_feed_ = 0;    // that is in force there
  std::vector<path::ChoicePoint> choice_points_;
  std::size_t shape_left_ = 0;       // motions of an arc or a hole that are to come: it stays in one chunk
  std::optional<cl::Record> shape_;  // that the next motion begins
  bool feed_seen_ = false;           // in the present run: the next rapid ends it
  std::size_t points_ = 0;
  path::ChoiceSummary summary_;
};

}  // namespace trunnion::post
