#pragma once
#include <algorithm>
#include <array>
#include <limits>

#include "trunnion/machine/machine.hpp"

namespace trunnion::post {

/// How fast the axes of a machine are: its rapid rates, and the rates that they keep while cutting.
class AxisRates {
 public:
  explicit AxisRates(const Machine& machine);

  /// Time of a rapid: the slowest axis at its rapid rate.
  double rapid_seconds(const JointVector& a, const JointVector& b) const;
  /// The least time in which the axes can do it, moving linearly.
  double slowest_axis_s(const JointVector& a, const JointVector& b) const;
  /// The axis that needs it.
  AxisId slowest_axis(const JointVector& a, const JointVector& b) const;
  /// The same where the joints do not move linearly: `joints(t)` at the fraction t of the block's time.
  template <class Joints>
  double slowest_along_s(const Joints& joints) const {
    constexpr int kPieces = 16;
    double seconds = 0.0;
    JointVector before = joints(0.0);
    for (int i = 1; i <= kPieces; ++i) {
      const JointVector q = joints(static_cast<double>(i) / kPieces);
      seconds = std::max(seconds, kPieces * slowest_axis_s(before, q));
      before = q;
    }
    return seconds;
  }
  /// A rate that no linear axis exceeds in any direction, mm/s.
  double linear_rate_mm_s() const;
  bool turns(const JointVector& a, const JointVector& b) const;

  /// MAXDPM: no rotary axis is faster than this while cutting.
  void limit_rotary(double rad_s);
  /// The same for the segment at hand alone: a turn in place that has a time of its own. Infinity ends it.
  void limit_turn(double rad_s);

  // In columns of all positions, those that the machine has no axis for, too: these do not change.
  const std::array<double, kMaxAxes>& cutting() const { return cutting_; }  // mm/s, rad/s
  const JointVector& slowness() const { return slowness_; }                 // 1 / cutting, a little more
  const JointVector& linear_share() const { return linear_share_; }  // 1: a linear axis; 0: a rotary one
  const JointVector& rotary_share() const { return rotary_share_; }  // the other way round

 private:
  void set_slowness();

  struct OfAxis {
    bool linear = true;
    double rapid = 1.0;  // mm/s, rad/s
    double most = 1.0;   // what the machine file gives for cutting
  };
  std::size_t count_;
  std::array<OfAxis, kMaxAxes> of_;
  double rotary_rad_s_ = std::numeric_limits<double>::infinity();  // MAXDPM
  std::array<double, kMaxAxes> cutting_;
  JointVector linear_share_, rotary_share_, slowness_;
};

}  // namespace trunnion::post
