#pragma once
#include "post/making/safe_way.hpp"

namespace trunnion::post {

/// Where the rotary axes turn back or change the branch: away from the part, or at a rapid.
class RotaryTurns {
 public:
  RotaryTurns(ProgramInWork& work, CorrectedPlace& places, BlockMaker& blocks, SafeWay& safe_way)
      : work_(work), places_(places), blocks_(blocks), safe_way_(safe_way) {}

  /// On the straight way to `q` the tip would circle the part.
  bool rewinds(const path::Point& to, const JointVector& q) const;
  /// The rapid over the safe height.
  Result<void> rapid_above(const path::Point& to);
  /// The tool leaves along its axis, the rotary axes turn at the safe height, and the tool comes back.
  Result<void> turn_away(const JointVector& after, const ChunkMotion& motion);
  /// Before `motion`: the turn that was due at the end of the one before.
  Result<void> make_waiting(const ChunkMotion& motion);

 private:
  ProgramInWork& work_;
  CorrectedPlace& places_;
  BlockMaker& blocks_;
  SafeWay& safe_way_;
};

}  // namespace trunnion::post
