#include "app/wrong_use.hpp"

#include <algorithm>

#include "trunnion/base/nearest_name.hpp"
#include "trunnion/base/printable.hpp"

#include "app/command_tree.hpp"

namespace trunnion::app {
namespace {

const CLI::App* called_command(const CLI::App* app) {
  for (auto parsed = app->get_subcommands(); !parsed.empty(); parsed = app->get_subcommands())
    app = parsed.front();
  return app;
}

std::vector<std::string> option_names(const CLI::App* command) {
  std::vector<std::string> out;
  for (const CLI::App* app = command; app != nullptr; app = app->get_parent()) {
    for (const CLI::Option* option : app->get_options()) {
      for (const std::string& name : option->get_lnames()) out.push_back("--" + name);
    }
  }
  return out;
}

// Some errors bear the name of the command.
bool is(const CLI::Error& error, CLI::ExitCodes code) {
  return error.get_exit_code() == static_cast<int>(code);
}

// A word that begins so is an option, unless it is a negative number.
bool is_option(const std::string& word) {
  return word.size() > 1 && word[0] == '-' &&
         (word[1] == '-' || std::isalpha(static_cast<unsigned char>(word[1])));
}

std::string missing_text(const CLI::App* command) {
  std::vector<const CLI::Option*> missing;
  std::size_t width = 0;
  for (const CLI::Option* option : command->get_options()) {
    if (!option->get_required() || option->count() > 0) continue;
    missing.push_back(option);
    width = std::max(width, names_of(*option).size());
  }
  if (missing.empty()) return {};
  std::string out = "error: " + full_name(command) + " needs\n";
  for (const CLI::Option* option : missing) {
    const std::string names = names_of(*option);
    out += "  " + names + std::string(width - names.size() + 2, ' ') + option->get_description() + "\n";
  }
  return out;
}

std::string reason(const CLI::App* root, const CLI::App* command, const CLI::Error& error) {
  const std::vector<std::string> remaining = root->remaining(true);
  const auto unknown = std::find_if(remaining.begin(), remaining.end(), is_option);
  if (unknown != remaining.end()) {
    const std::string name = unknown->substr(0, unknown->find('='));
    return "error: " + full_name(command) + " has no option " + name +
           did_you_mean(name, option_names(command)) + "\n";
  }
  const auto below = subcommands(command);
  if (!below.empty() && !remaining.empty()) {
    std::vector<std::string> names;
    names.reserve(below.size());
    for (const CLI::App* sub : below) names.push_back(sub->get_name());
    return "error: " + full_name(command) + " has no command '" + remaining.front() + "'" +
           did_you_mean(remaining.front(), names) + "\n";
  }
  if (is(error, CLI::ExitCodes::RequiredError)) {
    if (std::string text = missing_text(command); !text.empty()) return text;
  }
  if (is(error, CLI::ExitCodes::ExtrasError) && !remaining.empty())
    return "error: " + full_name(command) + ": '" + remaining.front() + "' is one argument too many\n";
  const std::string said = error.what();
  return (said.starts_with("error: ") ? "" : "error: ") + said + "\n";
}

}  // namespace

std::string wrong_use_text(const CLI::App* root, const CLI::Error& error) {
  const CLI::App* command = called_command(root);
  const bool nothing_said = !subcommands(command).empty() && root->remaining(true).empty();
  if (nothing_said && is(error, CLI::ExitCodes::RequiredError))
    return command->help(command->get_parent() == nullptr ? "" : full_name(command->get_parent()));
  return printable(reason(root, command, error), "\n") + full_name(command) + " --help says more\n";
}

}  // namespace trunnion::app
