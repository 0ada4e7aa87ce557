#pragma once
#include <span>

#include "post/intake/intake.hpp"
#include "post/making/event_maker.hpp"
#include "post/making/measured_reach.hpp"
#include "post/making/plain_motions.hpp"
#include "post/making/shape_maker.hpp"

namespace trunnion::post {

/// The stage that makes the NC text of one program: prepared chunks in, in their order, their text out.
class Pipeline {
 public:
  Pipeline(const PostJob& job, const PostOptions& options);
  // Its parts know each other's places.
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;
  ~Pipeline() = default;

  Result<void> begin();
  /// Makes the NC text of a prepared chunk, and puts it there.
  Result<void> emit(Chunk& chunk);
  /// The end of the program: the text that is left is put into `end`.
  Result<void> finish(const Intake& intake, Chunk& end);
  /// Of the finished text, but for its verification. Fails with check_failed when a position is beyond the
  /// travel.
  Result<PostReport> report();
  const Diagnostics& diagnostics() const { return work_.posting.diagnostics; }

  /// Of the words, as path::Rounding has it.
  const JointVector& quantum() const { return work_.axis_words.rounding().quantum; }
  /// Of the machine, or null.
  const ModelEvaluator* errors() const { return work_.errors.evaluator.get(); }
  /// Where the errors hang on the position alone; else null.
  const path::Compensator* compensator_by_place(const SpindleTool& tool) const {
    return work_.errors.by_place ? &work_.errors.compensators->of(tool.length_mm) : nullptr;
  }

 private:
  /// The head of the program, when its first motions and what is said before them are known.
  Result<void> begin_text(const Chunk& chunk);
  Result<void> emit_run();
  void count_parts(const Chunk& chunk, std::size_t first, std::size_t end, int times);
  void set_tool(const SpindleTool& tool);

  ProgramInWork work_;
  ProgramHead head_;
  PlaceWords words_;
  LostMotion lost_motion_;
  CorrectedPlace places_;
  BlockBend bend_;
  BlockMaker blocks_;
  SafeWay safe_way_;
  RotaryTurns turns_;
  SegmentMaker segments_;
  PlainMotions plain_;
  ShapeMaker shapes_;
  CutterWords cutter_words_;
  EventMaker events_;
  MeasuredReach reach_;
};

}  // namespace trunnion::post
