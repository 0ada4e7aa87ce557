#pragma once
#include "trunnion/machine/machine.hpp"
#include "trunnion/path/point.hpp"

namespace trunnion::test {

/// The grid of words with four decimals: 0.1 um and 0.0001 degrees.
inline path::Rounding four_decimals(const Machine& machine) {
  JointVector quantum;
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    quantum[id] = machine.axes[id].kind == AxisKind::rotary ? 1e-4 * kRadPerDegree : 1e-4;
  return path::Rounding::of(machine, machine.tool_vector(), quantum);
}

}  // namespace trunnion::test
