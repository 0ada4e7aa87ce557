#pragma once
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "trunnion/machine/machine.hpp"

#include "support/folders.hpp"

namespace trunnion::test {

/// Names of the machine files that ship with the project.
inline std::vector<std::string> shipped_machines() {
  return {"paper", "trunnion_offset", "nutating_45", "xyzac_trt"};
}

inline Machine shipped_machine(const std::string& name) {
  Diagnostics diagnostics;
  auto machine = load_machine(test::source_folder() + "/postconfigs/machines/" + name + ".toml", diagnostics);
  if (!machine) throw std::runtime_error(machine.error().text());
  return *machine;
}

/// Of its axes the linear and the rotary ones accelerate by so much.
inline Machine accelerating(double linear_mm_s2, double rotary_rad_s2,
                            const std::string& name = "trunnion_offset") {
  Machine machine = shipped_machine(name);
  for (Axis& axis : machine.axes)
    axis.acceleration = axis.kind == AxisKind::linear ? linear_mm_s2 : rotary_rad_s2;
  return machine;
}

/// X and Y there, the other axes at 0.
inline JointVector xy(double x, double y) {
  JointVector out;
  out[0] = x;
  out[1] = y;
  return out;
}

}  // namespace trunnion::test
