#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"

namespace trunnion::app {

/// Exit codes of the program (README, "Exit codes").
enum ExitCode { kDone = 0, kCheckFailed = 1, kWrongUse = 2, kWrongInput = 3, kIoFailed = 4, kDefect = 70 };

ExitCode exit_code(ErrorCode code);

/// Prints what a stage found to standard error, warnings and errors alike (`--quiet` keeps errors only).
void print(const Diagnostics& diagnostics);
/// Prints the error and gives the exit code that belongs to it.
ExitCode print_error(const Error& error);
/// For a stage that failed after filling `diagnostics`: prints them, and `error` too when it is not one of
/// them.
ExitCode print_failure(const Diagnostics& diagnostics, const Error& error);

/// Writes `text` to `path` through an AtomicFile (`-` is standard output).
ExitCode write_output(const std::string& path, const std::string& text);

/// Beyond what any length, angle, feed or time of an option means.
inline constexpr double kLargestOption = 1e9;

/// Takes numbers above 0 (CLI11's own check names the largest double in its message).
CLI::Validator above_zero();
/// Takes numbers from `low` to `high` (CLI11's own check takes `nan`).
CLI::Validator between(double low, double high);

/// "trunnion 0.1.0: <command line>", for the foot of a report.
std::string made_by();
/// Keeps the command line for `made_by`.
void remember_command_line(int argc, const char* const* argv);

/// Each subcommand lives in its own file and registers itself with the root; the callback stores the exit
/// code in `exit`.
// (declarations follow here, one a command: void add_<name>_command(CLI::App& root, int& exit);)
void add_post_command(CLI::App& root, int& exit);
void add_verify_command(CLI::App& root, int& exit);
void add_batch_command(CLI::App& root, int& exit);
void add_compare_command(CLI::App& root, int& exit);
void add_machine_command(CLI::App& root, int& exit);
/// Member of the group `trunnion machine`.
void add_machine_calibrate_command(CLI::App& machine, int& exit);
void add_iso230_command(CLI::App& root, int& exit);
void add_model_command(CLI::App& root, int& exit);
void add_simulate_command(CLI::App& root, int& exit);
void add_measurements_command(CLI::App& root, int& exit);
void add_study_command(CLI::App& root, int& exit);
void add_probe_command(CLI::App& root, int& exit);
/// Members of the group `trunnion machine`.
void add_machine_check_command(CLI::App& machine, int& exit);
void add_machine_new_command(CLI::App& machine, int& exit);
/// Members of the group `trunnion model`.
void add_model_effects_command(CLI::App& model, int& exit);
void add_thermal_command(CLI::App& root, int& exit);
void add_table_command(CLI::App& root, int& exit);
/// Not in the help: for packages and shells.
void add_texts_command(CLI::App& root, int& exit);

}  // namespace trunnion::app
