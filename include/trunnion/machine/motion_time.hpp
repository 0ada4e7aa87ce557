#pragma once
#include <optional>

#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// How long blocks take on axes that accelerate no faster than they can (Axis::acceleration; README, "Time"):
/// straight from end to end in all axes, the speed a trapezoid. Give it the blocks one after the other.
class MotionTime {
 public:
  /// @param blend_mm  the control goes over into the next block while it slows down, and leaves the corner by
  ///                  no more than this; nothing: it comes to rest at the end of every block (exact path)
  MotionTime(const Machine& machine, std::optional<double> blend_mm)
      : machine_(machine), blend_mm_(blend_mm) {}

  /// The machine file says of every axis how fast it accelerates.
  static bool is_known(const Machine& machine);

  /// By its words a block lasts no less, or its speed is not reached.
  double least_seconds(const JointVector& from, const JointVector& to) const;
  /// A block that lasts `seconds` by its words; needs is_known. Gives what it adds to the time: of itself,
  /// and of the corner before it.
  double go(const JointVector& from, const JointVector& to, double seconds);
  /// The control stands still here (a dwell, a tool change, the end). Gives what that adds.
  double stop();

 private:
  struct Block {
    double length = 0.0;  // of the linear axes, mm; of the rotary ones, degrees, where these stand still
    Vec3 direction = Vec3::Zero();
    double speed = 0.0;
    double acceleration = 0.0;
  };
  /// Square of the time in which a block could be begun and half run by all of its acceleration.
  double square_seconds(const JointVector& from, const JointVector& to) const;
  /// Speed of `before` from which on the next block takes over.
  double corner_speed(const Block& before, const Block& next) const;

  const Machine& machine_;
  std::optional<double> blend_mm_;
  std::optional<Block> before_ = {};
};

}  // namespace trunnion
