#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace trunnion::app {

/// Completion scripts for the shells, from the tables that the command line is parsed with: commands, options
/// and what may stand behind them. Names of machines, controllers and effects are asked of the program as
/// they are needed (`trunnion texts names`).
std::string bash_completion(const CLI::App& root);
std::string zsh_completion(const CLI::App& root);
std::string fish_completion(const CLI::App& root);

}  // namespace trunnion::app
