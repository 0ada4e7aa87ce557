#pragma once
#include <array>
#include <cstdint>

#include "trunnion/path/point.hpp"

#include "post/feeds/feed_plan.hpp"
#include "post/intake/joint_pair.hpp"
#include "post/making/beyond_travel.hpp"
#include "post/making/posting.hpp"
#include "post/tools/spindle_tool.hpp"

namespace trunnion::post {

/// Joint positions as the words of the machine that stand for them: shifted by the work offset and the tool,
/// rounded to the digits of each axis, and within its travel.
class JointWords {
 public:
  JointWords(const Posting& posting, const SpindleTool& tool);

  void set_tool(const SpindleTool& tool);
  /// As the machine of the posting has it now (LIMITS).
  void take_travel();

  const path::Rounding& rounding() const { return rounding_; }
  double rounded(AxisId id, double q) const { return rounding_.rounded(id, q); }
  /// By which the rounding of the linear words moves the tip at most, mm.
  double radius_mm() const { return radius_mm_; }
  /// The words of all axes stand on their grid: blocks can be written in runs.
  bool fill_runs() const { return fill_runs_; }
  /// The word of an axis minus its joint position.
  double offset(AxisId id) const { return rounding_.offset[id]; }
  /// Not rounded.
  JointVector of(const JointVector& q) const {
    JointVector out = q;
    for (AxisId id = 0; id < kMaxAxes; ++id) out[id] += rounding_.offset[id];
    return out;
  }
  /// Positions that the machine has no axis for are zero, as their travel.
  bool are_within_travel(const JointVector& q) const { return joints_within(q, least_, most_); }

  /// `q` goes out: where it is beyond the travel, it is noted for the end of the program.
  void check_travel(const JointVector& q, const SpindleTool& tool, SourceRef where) {
    if (!are_within_travel(q)) beyond_.note(posting_.machine, q, rounding_.quantum, tool, where);
  }
  Result<void> tell_beyond_travel(Posting& posting) const { return beyond_.tell(posting); }

  /// The motion of all axes to `q`; it stands until the next one.
  const nc::Motion& motion(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed, SourceRef where);
  /// The words of a position on the grid; false where it is beyond the travel. What more digits would need
  /// than a run of blocks takes comes out as more than it takes.
  bool put(const JointVector& q, nc::RunBlock& block) const {
    static_assert(kMaxAxes == 5 && nc::RunBlock::kAxes == 5, "two pairs and one");
    const JointVector& offset = rounding_.offset;
    for (const AxisId id : {AxisId{0}, AxisId{2}})
      put_whole((joint_pair(q, id) + joint_pair(offset, id)) * joint_pair(quanta_per_unit_, id),
                &block.words[id]);
    std::array<std::int32_t, 2> last;
    put_whole(Lanes{(q[4] + offset[4]) * quanta_per_unit_[4], 0.0}, last.data());
    block.words[4] = last[0];
    return are_within_travel(q);
  }

 private:
  const Posting& posting_;
  path::Rounding rounding_;
  JointVector least_, most_;  // travel
  BeyondTravel beyond_;
  JointVector quanta_per_unit_;
  double radius_mm_ = 0.0;
  std::size_t axis_count_;
  bool fill_runs_;
  nc::Motion motion_;
};

}  // namespace trunnion::post
