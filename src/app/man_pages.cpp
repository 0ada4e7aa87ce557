#include "app/man_pages.hpp"

#include <algorithm>
#include <cctype>

#include "app/command_tree.hpp"

namespace trunnion::app {
namespace {

// "trunnion-model-fit"
std::string page_name(const CLI::App* command) {
  std::string out = full_name(command);
  std::replace(out.begin(), out.end(), ' ', '-');
  return out;
}

std::string bold(std::string_view text) {
  return "\\fB" + man_text(text) + "\\fR";
}

std::string value_text(const OptionValue& value) {
  return value.type.empty() ? "" : " \\fI" + man_text(value.type) + "\\fR";
}

std::string option_text(const CLI::Option& option) {
  const OptionValue value = value_of(option);
  std::string out = ".TP\n";
  if (option.get_positional()) {
    out += bold(option.get_name(true));
  } else {
    std::string names;
    for (const std::string& name : option.get_snames())
      names += (names.empty() ? "" : ", ") + bold("-" + name);
    for (const std::string& name : option.get_lnames())
      names += (names.empty() ? "" : ", ") + bold("--" + name);
    out += names;
  }
  out += value_text(value) + "\n" + man_text(option.get_description()) + "\n";
  std::string rules;
  const auto add = [&](const std::string& rule) { rules += (rules.empty() ? "" : "; ") + rule; };
  if (option.get_required()) add("must be given");
  if (!value.choices.empty()) {
    std::string choices;
    for (const std::string& choice : value.choices) choices += (choices.empty() ? "" : ", ") + bold(choice);
    add("one of " + choices);
  }
  if (!value.limits.empty()) add(man_text(value.limits == "POSITIVE" ? "above 0" : value.limits));
  if (!value.standard.empty()) add("default " + bold(value.standard));
  return rules.empty() ? out : out + "(" + rules + ")\n";
}

std::string options_text(const CLI::App& command, bool positional) {
  std::string out;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional() == positional && !option->get_group().empty()) out += option_text(*option);
  }
  return out;
}

std::string synopsis(const CLI::App& command) {
  std::string out = bold(full_name(&command)) + " [\\fIOPTIONS\\fR]";
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) out += " \\fI" + man_text(option->get_name(true)) + "\\fR";
  }
  return out + (subcommands(&command).empty() ? "" : " \\fICOMMAND\\fR") + "\n";
}

// Exit codes and what the environment says: the same for every command.
constexpr const char* kCommonEnd = R"(.SH EXIT STATUS
.TP
.B 0
done, and every check passed
.TP
.B 1
done, but a check failed (tolerance, limits, unreachable); no output file unless it was asked for all the same
.TP
.B 2
wrong use of the command line
.TP
.B 3
wrong input data; the message says file, line and column
.TP
.B 4
a file could not be read or written, or no memory or thread be had
.TP
.B 70
a defect of the program
.SH ENVIRONMENT
.TP
.B TRUNNION_POSTCONFIGS
folder with the machine and controller files that options name, instead of the installed one
.TP
.B NO_COLOR
messages without colour
)";

std::string see_also(const CLI::App& command) {
  std::string out = ".SH SEE ALSO\n";
  if (command.get_parent() != nullptr) out += ".BR " + man_text(page_name(command.get_parent())) + " (1),\n";
  for (const CLI::App* sub : subcommands(&command)) out += ".BR " + man_text(page_name(sub)) + " (1),\n";
  return out +
         ".BR trunnion\\-machine (5),\n.BR trunnion\\-controller (5),\n.BR trunnion\\-model (5),\n.BR "
         "trunnion\\-measurements (5),\n.BR trunnion\\-tools (5)\n";
}

void add_pages(const CLI::App& command, std::map<std::string, std::string>& out) {
  const auto below = subcommands(&command);
  std::string text = man_head(page_name(&command), 1);
  text += ".SH NAME\n" + man_text(page_name(&command)) + " \\- " + man_text(command.get_description()) + "\n";
  text += ".SH SYNOPSIS\n" + synopsis(command);
  if (!below.empty()) {
    text += ".SH COMMANDS\n";
    for (const CLI::App* sub : below)
      text += ".TP\n" + bold(sub->get_name()) + "\n" + man_text(sub->get_description()) + "\n";
  }
  if (const std::string arguments = options_text(command, true); !arguments.empty())
    text += ".SH ARGUMENTS\n" + arguments;
  text += ".SH OPTIONS\n" + options_text(command, false) + kCommonEnd + see_also(command);
  out.emplace(page_name(&command) + ".1", std::move(text));
  for (const CLI::App* sub : below) add_pages(*sub, out);
}

}  // namespace

std::string man_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool begins_line = out.empty() || out.back() == '\n';
    if (begins_line && (c == '.' || c == '\'')) out += "\\&";
    if (c == '-')
      out += "\\-";
    else if (c == '\\')
      out += "\\e";
    else
      out += c;
    if (c == '\n' && out.size() > 1) out.insert(out.size() - 1, "\n.br");  // a line of a list stays one
  }
  return out;
}

std::string man_head(const std::string& name, int section) {
  std::string title = name;
  std::transform(title.begin(), title.end(), title.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return ".TH \"" + man_text(title) + "\" " + std::to_string(section) + " \"\" \"trunnion " +
         TRUNNION_VERSION + "\" \"trunnion\"\n";
}

std::map<std::string, std::string> command_pages(const CLI::App& root) {
  std::map<std::string, std::string> out;
  add_pages(root, out);
  return out;
}

}  // namespace trunnion::app
