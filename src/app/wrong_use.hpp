#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace trunnion::app {

/// What the user reads when the command line cannot be taken: every option that is missing with what it is,
/// the nearest command or option to one that does not exist, the help where no command was given.
std::string wrong_use_text(const CLI::App* root, const CLI::Error& error);

}  // namespace trunnion::app
