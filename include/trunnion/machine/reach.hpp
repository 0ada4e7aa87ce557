#pragma once
#include <string>
#include <vector>

#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// How far the tool axis can be tilted on the part, and where the travels of the linear axes end: what a new
/// machine file is looked through for.
struct MachineReach {
  /// Every direction of the tool axis up to this angle from the spindle's is within the travel of the rotary
  /// axes (steps of one degree).
  Angle every_way;
  /// Some direction is, up to this angle.
  Angle one_way;
  /// With the tip at the part's zero and the rotary axes anywhere in their travel (steps of five degrees):
  /// how far each linear axis goes beyond its travel, and at which rotary positions. Those that stay within
  /// it do not stand here.
  struct Beyond {
    AxisId axis = 0;
    double by_mm = 0.0;
    JointVector at;
  };
  std::vector<Beyond> beyond;
};
MachineReach machine_reach(const Machine& machine);

}  // namespace trunnion
