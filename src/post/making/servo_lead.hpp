#pragma once
#include <optional>
#include <span>
#include <vector>

#include "trunnion/base/source_ref.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::post {

/// Axes that follow their commands late are sent ahead: where the axes are to be at x(t), each is commanded
/// to c = x + tau dx/dt, which a servo with the delay tau follows to x.
///
/// In words that has a price. Where blocks meet, dx/dt jumps, and c with it: the axes go over such a corner
/// slower, so that the jump stays small, and there c is in the middle of it; where a control may stop, at
/// sharp corners of any axes, so that all of the lead is small. Towards a corner and from it they go slower
/// and faster no faster than they surely can, in blocks short enough to say so: how a control accelerates by
/// itself nobody knows here.
class ServoLead {
 public:
  /// `lag_s`: tau of each axis; all 0: nothing is led. `tolerance_mm`: of the program.
  ServoLead(const Machine& machine, const JointVector& lag_s, double tolerance_mm);

  bool is_on() const { return is_on_; }

  /// A feed block as it is meant: straight in all axes.
  struct Block {
    JointVector from, to;  // mm, rad
    double seconds = 0.0;  // above 0
    SourceRef where;
  };
  /// A block that is commanded for it.
  struct Led {
    JointVector to;
    double seconds = 0.0;
    SourceRef where;
    JointVector by;  // of `to`, what is the lead
  };
  void add(const Block& block) { blocks_.push_back(block); }
  bool is_idle() const { return blocks_.empty(); }
  std::size_t size() const { return blocks_.size(); }
  /// Of the blocks that were added; there is one.
  const JointVector& begins_at() const { return blocks_.front().from; }
  double seconds() const {
    double out = 0.0;
    for (const Block& block : blocks_) out += block.seconds;
    return out;
  }
  /// What is commanded for the blocks that were added, from rest to rest.
  std::vector<Led> take();

 private:
  /// A block with its velocity and the paces (shares of it) between which it is run.
  struct Run;
  void plan(std::vector<Run>& runs) const;
  /// `velocity_behind`: of the block behind; nothing where the axes come to rest.
  void lead(const Run& run, const std::optional<JointVector>& velocity_behind, std::vector<Led>& out) const;
  Led led_at(const Run& run, double u, const std::optional<JointVector>& velocity_behind) const;
  double led_mm(const JointVector& velocity) const;
  bool is_sharp(const Run& before, const Run& behind) const;
  double pace_change(const JointVector& velocity) const;

  const Machine& machine_;
  JointVector lag_s_;
  double jump_mm_;
  bool is_on_ = false;
  std::vector<Block> blocks_;
};

}  // namespace trunnion::post
