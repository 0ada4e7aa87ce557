#pragma once
#include "post/making/rotary_turns.hpp"
#include "post/prepare/refinement.hpp"

namespace trunnion::post {

/// Motions of the CL path, one after the other: with the points that were inserted beforehand or are now,
/// over the safe height where they must go there.
class SegmentMaker {
 public:
  SegmentMaker(ProgramInWork& work, const BlockBend& bend, BlockMaker& blocks, SafeWay& safe_way,
               RotaryTurns& turns);

  void set_tool(const SpindleTool& tool);
  /// `prepared`: its points; null: they are found now.
  Result<void> make(const path::Point& to, const ChunkMotion& motion, const PreparedSegment* prepared);
  /// The segment to motion `i` of the chunk, where it was prepared for what is about to be done.
  const PreparedSegment* prepared(std::size_t i) const;
  /// Where programmed points may be dropped or moved: the last of the cutting motions from `first` on that
  /// are one run (one feed, nothing said between them); `first` itself otherwise. `event` is the next one.
  std::size_t cutting_run_end(std::size_t first, std::size_t event) const;
  Result<void> make_cutting_run(std::size_t first, std::size_t last);
  /// On the way to `next`, the position of `motion`, the rotary axes turn away from the part where they must.
  /// True when the tool is there already.
  Result<bool> reconfigure(const path::ChosenPoint& next, const ChunkMotion& motion);
  /// For the report.
  void note(const path::SegmentReport& report);

 private:
  Result<void> go_to(const path::Point& point, const ChunkMotion& motion);

  ProgramInWork& work_;
  const BlockBend& bend_;
  BlockMaker& blocks_;
  SafeWay& safe_way_;
  RotaryTurns& turns_;
  Refinement refined_;
};

}  // namespace trunnion::post
