#pragma once
#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// How long blocks take on axes that accelerate no faster than they can (Axis::acceleration; README, "Time"):
/// straight from end to end in all axes, the speed a trapezoid.
class MotionTime {
 public:
  /// `stops`: the control comes to rest at the end of every block (exact path); else it goes over into the
  /// next one while it slows down (blending).
  MotionTime(const Machine& machine, bool stops) : machine_(machine), stops_(stops) {}

  /// The machine file says of every axis how fast it accelerates.
  static bool is_known(const Machine& machine);

  /// Seconds of a block that lasts `seconds` by its words; needs is_known.
  double of(const JointVector& from, const JointVector& to, double seconds) const;

 private:
  const Machine& machine_;
  bool stops_;
};

}  // namespace trunnion
