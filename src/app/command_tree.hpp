#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

// The program's commands and options as its texts need them: help, man pages, completion and messages all
// come from what CLI11 parses with.
namespace trunnion::app {

/// Commands below `command` that the help lists, in its order.
std::vector<const CLI::App*> subcommands(const CLI::App* command);
/// "trunnion model fit".
std::string full_name(const CLI::App* command);
/// "-o,--output", "part".
std::string names_of(const CLI::Option& option);

/// What may stand behind an option, or as an argument.
struct OptionValue {
  std::string type;                  // "FLOAT", "MACHINE"; empty: nothing stands there (a flag)
  std::vector<std::string> choices;  // all that may stand there; empty: not listed
  std::string limits;                // "POSITIVE", "0 to 10"
  std::string standard;              // what holds without it
};
OptionValue value_of(const CLI::Option& option);

/// Types of options that name something which the program can list (`trunnion texts names`).
inline constexpr const char* kMachineName = "MACHINE";
inline constexpr const char* kControllerName = "CONTROLLER";
inline constexpr const char* kEffectName = "EFFECT";
inline constexpr const char* kMakerName = "MAKER_MACHINE";

}  // namespace trunnion::app
