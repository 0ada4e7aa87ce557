#pragma once
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "trunnion/post/post.hpp"

#include "post/intake/long_run.hpp"

namespace trunnion::post {

/// First stage: gathers the records of the CL file into chunks and chooses the joints of their motions. A
/// chunk ends where nothing that follows can change the choice: before the rapid that begins a new run, at a
/// tool change, and within a long run behind a point that one position only reaches. A long run in which
/// there is no such point is buffered (packed) to its end and then goes on in pieces.
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
  std::unique_ptr<Chunk> next_piece() { return long_run_.next_piece(); }
  /// What is left at the end of the file.
  std::unique_ptr<Chunk> finish() { return flush(); }

  /// Motions of the text.
  std::size_t points() const { return points_; }
  const path::ChoiceSummary& choice() const { return choice_.summary(); }
  const ProgramTools& tools() const { return tools_; }

 private:
  std::unique_ptr<Chunk> flush();
  std::unique_ptr<Chunk> fresh();
  void hold_where_long();
  /// Motions of the present run.
  bool run_is_empty() const { return chunk_->points.empty() && !long_run_.is_held(); }
  const ToolPose& last_pose() const {
    return long_run_.is_held() ? long_run_.last_pose() : chunk_->points.back().pose;
  }
  std::size_t run_size() const { return long_run_.is_held() ? long_run_.size() : chunk_->size(); }
  std::unique_ptr<Chunk> take_word(const cl::Record& record);
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

  const PostJob& job_;
  const PostOptions& options_;
  ChunkStore& store_;
  ProgramTools tools_;
  SpindleTool tool_;
  /// Of the tool that comes next.
  struct Coming {
    FluteLength flute;                // of the one whose words were read last
    std::optional<SpindleTool> tool;  // behind what is still handed on of the run before
  };
  Coming coming_;
  bool tool_known_ = false;  // a tool was loaded, or nothing asks for one
  PathTolerances tolerances_;
  JointChoice choice_;
  LongRun long_run_;
  std::unique_ptr<Chunk> chunk_;
  std::size_t shape_left_ = 0;       // motions of an arc or a hole that are to come: it stays in one chunk
  std::optional<cl::Record> shape_;  // that the next motion begins
  bool feed_seen_ = false;           // in the present run: the next rapid ends it
  std::size_t points_ = 0;
};

}  // namespace trunnion::post
