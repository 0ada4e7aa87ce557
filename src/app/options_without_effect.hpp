#pragma once
#include <CLI/CLI.hpp>

namespace trunnion::app {

/// Warns of options that do something only beside others, where none of those is given: a limit of the
/// thermal offsets without offsets. They are no error, since a script may give them to every program.
void warn_of_options_without_effect(const CLI::App& root);

}  // namespace trunnion::app
