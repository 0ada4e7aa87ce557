#pragma once
#include <deque>
#include <optional>
#include <vector>

#include "trunnion/post/verify.hpp"

#include "post/judging/match_places.hpp"
#include "post/judging/program_judge.hpp"
#include "post/offset_tracker.hpp"
#include "post/program_state.hpp"

// Private to the verifier: the last blocks of a cut, to be matched anew where a later one shows that they
// were matched to the wrong places.
namespace trunnion::post {

/// What the verification knew before a block.
struct TrailMark {
  std::size_t block = 0;  // of the trail, which ends there
  Place at;
  CutFigures figures;
  double judged_axis_rad = 0.0;
  std::size_t recorded = 0;  // VerifyReport::blocks
  double path_mm = 0.0;
  ProgramState program;
  std::optional<OffsetTracker> offsets;
  ProgramJudge::Found found;
};

/// The blocks of a cut since its begin, or as many of them as are worth keeping.
struct BlockTrail {
  struct Block {
    BlockEnd end;
    double seconds = 0.0;
  };
  /// As many blocks as these are kept at least where the cut is longer. A match that goes wrong shows it as
  /// soon as the path goes elsewhere than the place that was taken for it.
  static constexpr std::size_t kKept = 256;
  /// Blocks from mark to mark.
  static constexpr std::size_t kApart = 8;

  void clear() {
    blocks.clear();
    marks.clear();
  }
  bool wants_mark() const { return marks.empty() || blocks.size() > marks.back().block + kApart; }
  /// Leaves out what is no longer worth keeping.
  void shorten() {
    if (blocks.size() < 2 * kKept) return;
    std::size_t kept = 0;
    while (kept + 1 < marks.size() && marks[kept + 1].block + kKept <= blocks.size()) ++kept;
    const std::size_t gone = marks[kept].block;
    for (; kept > 0; --kept) marks.pop_front();
    blocks.erase(blocks.begin(), blocks.begin() + static_cast<std::ptrdiff_t>(gone));
    for (TrailMark& mark : marks) mark.block -= gone;
  }

  std::vector<Block> blocks;    // the first one is where the others begin
  std::deque<TrailMark> marks;  // the first one at block 0
};

}  // namespace trunnion::post
