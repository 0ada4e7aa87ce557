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

}  // namespace trunnion::test
