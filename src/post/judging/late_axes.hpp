#pragma once
#include "post/feeds/control_times.hpp"
#include "post/judging/deviation_meter.hpp"

// Private to the verifier.
namespace trunnion::post {

/// Where axes that follow their commands late are when a block ends: behind each stands a first-order lag, so
/// that dx/dt = (c - x) / tau, solved exactly over blocks that run evenly in their time.
class LateAxes {
 public:
  explicit LateAxes(const JointVector& lag_s) : lag_s_(lag_s) {
    for (AxisId id = 0; id < kMaxAxes; ++id) are_late_ = are_late_ || lag_s_[id] != 0.0;
  }

  bool are_late() const { return are_late_; }
  /// They have come to where they were commanded.
  void rest() { behind_ = {}; }
  /// The block at hand is commanded to `end`: gives where the axes are then, by its words and F. Rapids and
  /// ways that are not known end at rest.
  JointVector follow(const BlockEnd& end, const ControlTimes& times);
  /// By its words the last block goes from here to there: what travel and speeds are judged by.
  const JointVector& from() const { return from_; }
  const JointVector& commanded() const { return commanded_; }

 private:
  JointVector lag_s_;
  bool are_late_ = false;
  bool started_ = false;
  bool tcp_ = false;                       // the last block
  Vec3 word_tip_P_ = Vec3::Zero();         // of it
  JointVector from_, commanded_, behind_;  // x - c
};

}  // namespace trunnion::post
