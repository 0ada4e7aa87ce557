#pragma once
#include <CLI/CLI.hpp>

namespace trunnion::app {

/// `trunnion thermal serve`, under the command `thermal`.
void add_thermal_serve_command(CLI::App& thermal, int& exit);
/// `trunnion thermal split`.
void add_thermal_split_command(CLI::App& thermal, int& exit);
/// `trunnion thermal simulate` and `trunnion thermal assess`.
void add_thermal_sample_commands(CLI::App& thermal, int& exit);

}  // namespace trunnion::app
