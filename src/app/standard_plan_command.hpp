#pragma once
#include <CLI/CLI.hpp>

namespace trunnion::app {

/// Member of the group `trunnion measurements`.
void add_standard_plan_command(CLI::App& measurements, int& exit);

}  // namespace trunnion::app
