#pragma once
#include "post/judging/path_follower.hpp"

// Private to the verifier.
namespace trunnion::post {

/// Whether a block may be left out of the figures of the report, from a bound that costs little: QuietRun for
/// one block.
struct QuietBlock {
  bool may_be = false;
  bool tip_keeps = false, axis_keeps = false;
  bool flute_keeps = false;  // where it counts
  double axis = 0.0;         // by which the tool axis leaves its course at most (a sine)
  double axis_at_tip = 0.0;  // the same from the axis that the path has where the tip is, where that keeps
  bool surely() const { return tip_keeps && axis_keeps && flute_keeps; }
};

/// What the blocks are held against.
struct QuietTest {
  /// The block from `from` to `v`, which ends at `place` and leaves its chord by `bow` at most.
  QuietBlock of(const ToolPose& from, const ToolPose& v, const Place& place,
                const path::Certifier::Bows& bow) const;
  /// The place at which the block ends, where that is found without a look ahead and no more has to be asked
  /// about the block than `of` asks.
  std::optional<Place> place(const ToolPose& from, const ToolPose& v) const;

  const PathFollower& path;
  const KnownFigures& known;
  double most_off_mm;  // the largest distance from a CL point in the report so far
};

/// Goes along the chord of a block, to the feet of the CL points that it passes.
struct ChordFoot {
  ChordFoot(const ToolPose& a, const ToolPose& b)
      : from(a), way(b.tip_P - a.tip_P), turn(b.axis_P - a.axis_P), length2(way.squaredNorm()) {}
  void go_to(const Target& corner) {
    t = length2 > 0.0 ? std::clamp((corner.tip_P - from.tip_P).dot(way) / length2, t, 1.0) : 1.0;
  }
  Vec3 tip_P() const { return from.tip_P + t * way; }
  Vec3 axis_P() const { return from.axis_P + t * turn; }

  const ToolPose& from;
  Vec3 way, turn;
  double length2;
  double t = 0.0;
};

}  // namespace trunnion::post
