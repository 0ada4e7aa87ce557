#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// A block in ways of the axes over their accelerations (square seconds): a place changes its speed in one
/// axis by 1 at most.
struct AxisWay {
  std::array<double, kMaxAxes> along{};  // direction, of length 1
  double length = 0.0;
  double per_length = 0.0;  // 1 / length
  double asked_s = 0.0;
  double acceleration = 0.0;  // along the block, at most
  double fastest2 = 0.0;      // square of the speed that is asked for
};

/// How a block begins: behind a stop, behind a way that is not known, or from the block before it.
enum class BlockBegin : std::uint8_t { at_rest, unknown, at_corner };

/// Takes blocks to such ways.
class AxisWays {
 public:
  /// As MotionPlan has them.
  AxisWays(const Machine& machine, const JointVector& digits);

  AxisWay of(const JointVector& from, const JointVector& to, double seconds) const;
  /// By how much of `along` the path turns from one block into the next; what rounded words turn it by is no
  /// turn.
  double turn_of(AxisId id, const AxisWay& before, const AxisWay& next) const;
  /// By how much the linear axes turn there, mm for each unit of length.
  double linear_turn(const AxisWay& before, const AxisWay& next) const;

 private:
  std::array<double, kMaxAxes> acceleration_{}, per_acceleration_{}, digits_{};
  std::array<bool, kMaxAxes> is_linear_{};
};

}  // namespace trunnion
