#pragma once
#include <CLI/CLI.hpp>

namespace trunnion::app {

/// `type_name` of an option that names a file to write. `--output`, `--json`, `--report`, `--model-out` and
/// `--journal` are such whatever their type.
inline constexpr const char* kFileToWrite = "OUT";

/// What holds for the options of every command, when they are all read and before the command begins. Throws
/// CLI::ValidationError (wrong use):
/// - a file that is written is named by another option too, as input or as output (`model fit` and `model
/// add` may
///   write their --model anew), or two go to standard output;
/// - the name of a file that is to be written is empty;
/// - two inputs are standard input;
/// - a number is not finite.
void check_options_together(const CLI::App& root);

}  // namespace trunnion::app
