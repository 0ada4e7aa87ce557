#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "trunnion/machine/machine.hpp"
#include "trunnion/machine/motion_time.hpp"

namespace trunnion {

/// How a control goes over from one block to the next.
struct BlockEnds {
  /// It comes to rest at the end of every block, or as good as.
  bool stops = false;
  /// It leaves a corner by no more than this, mm in the linear axes; nothing: not known, so that it has half
  /// of either block for the corner.
  std::optional<double> blend_mm;
  /// It slows down in time for what many blocks ahead ask for (README of the machine layer, "Look-ahead");
  /// otherwise it looks one block ahead (MotionTime).
  bool looks_ahead = true;
};

/// How fast the axes get along a program, block by block: no axis accelerates faster than it can, none is
/// faster than a block asks for, and otherwise it is as fast as can be. Needs MotionTime::is_known.
class MotionPlan {
 public:
  /// @param digits  of the words, mm and rad: places of block ends are known to half of that, and what this
  ///                alone turns a path by asks for no acceleration; 0: they are exact
  /// `machine` must outlive the plan.
  MotionPlan(const Machine& machine, const BlockEnds& ends, const JointVector& digits, PlanOf what);
  MotionPlan(MotionPlan&&) noexcept;
  MotionPlan& operator=(MotionPlan&&) noexcept;
  ~MotionPlan();

  /// The machine file says of every axis how fast its acceleration changes (Axis::jerk). Kept by controls
  /// that look many blocks ahead.
  static bool knows_jerk(const Machine& machine);

  /// A block, straight in all axes.
  struct Block {
    const JointVector& from;
    const JointVector& to;
    double seconds = 0.0;  // at the speed that is asked for; above 0
    /// A rapid, or beside the path. A control that looks many blocks ahead is taken to stop at both its ends,
    /// one that looks one ahead between such a block and one on the path.
    bool apart = false;
  };
  /// The next block. The machine begins at rest.
  void add(const Block& block);
  /// It stands still behind the last block: nothing follows that it could go over into.
  void stop();
  /// It comes to rest behind the last block, and goes on: from a feed move to a rapid.
  void rest();
  /// What it does behind the last block is not known, nor how fast it is where it does: nothing that was
  /// added before and nothing that is added from here on is slowed down by it.
  void lose();
  /// Blocks that were added and not settled.
  std::size_t waiting() const;
  /// Settles the first `count` of those that wait: what comes of each goes to `out`, in their order. The
  /// machine is taken to come to rest behind the last one that waits, so that the more of them wait behind
  /// those that are settled, the less that slows these down.
  void settle(std::size_t count, std::vector<BlockRun>& out);

 private:
  class Kind;
  class OneAhead;
  template <class Path>
  class ManyAhead;
  std::unique_ptr<Kind> kind_;
};

}  // namespace trunnion
