#include "app/completion.hpp"

#include <algorithm>
#include <functional>

#include "trunnion/base/texts.hpp"

#include "app/command_tree.hpp"

namespace trunnion::app {
namespace {

using Visit = std::function<void(const CLI::App&)>;

void for_each_command(const CLI::App& command, const Visit& visit) {
  visit(command);
  for (const CLI::App* sub : subcommands(&command)) for_each_command(*sub, visit);
}

// "model fit"; empty for the program itself.
std::string path_of(const CLI::App& command) {
  const std::string name = full_name(&command);
  const auto blank = name.find(' ');
  return blank == std::string::npos ? "" : name.substr(blank + 1);
}

std::vector<std::string> dashed_names(const CLI::Option& option) {
  std::vector<std::string> out;
  for (const std::string& name : option.get_snames()) out.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) out.push_back("--" + name);
  return out;
}

// Those of the commands above it hold for a command too.
std::vector<const CLI::Option*> options_of(const CLI::App& command) {
  std::vector<const CLI::Option*> out;
  for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
    for (const CLI::Option* option : app->get_options()) {
      const bool is_help = !option->get_positional() && option->check_name("--help");
      if (option->get_positional() || option->get_group().empty() || (is_help && app != &command)) continue;
      out.push_back(option);
    }
  }
  return out;
}

// What `trunnion texts names` calls it.
std::string listed_kind(const std::string& type) {
  if (type == kMachineName) return "machines";
  if (type == kControllerName) return "controllers";
  if (type == kEffectName) return "effects";
  if (type == kMakerName) return "makers";
  return "";
}

// Within single quotes of all three shells; the first line of a list.
std::string quoted_line(std::string text) {
  text = text.substr(0, text.find('\n'));
  for (std::size_t at = 0; (at = text.find('\'', at)) != std::string::npos; at += 4)
    text.replace(at, 1, "'\\''");
  return "'" + text + "'";
}

// fish takes \' within quotes.
std::string fish_quoted(std::string text) {
  text = text.substr(0, text.find('\n'));
  for (std::size_t at = 0; (at = text.find_first_of("'\\", at)) != std::string::npos; at += 2)
    text.insert(at, "\\");
  return "'" + text + "'";
}

// What a shell does to offer the values of an option: words round the choices, and round the kind of names.
struct ShellWords {
  const char* choices_open;
  const char* choices_close;
  const char* names_open;
  const char* names_close;
  std::string offer(const OptionValue& value) const {
    const std::string kind = listed_kind(value.type);
    return kind.empty() ? choices_open + joined(value.choices, " ") + choices_close
                        : names_open + kind + names_close;
  }
};
constexpr ShellWords kBash = {"values='", "'", "files=1 values=$(_trunnion_names ", ")"};
constexpr ShellWords kZsh = {"values=(", ")", "files=1 values=(${(f)\"$(trunnion texts names ", ")\"})"};

// Branches of a `case "$command $option"`: the values of each option that has some to offer.
std::string value_cases(const CLI::App& root, const ShellWords& words) {
  std::string out;
  for_each_command(root, [&](const CLI::App& command) {
    for (const CLI::Option* option : options_of(command)) {
      const OptionValue value = value_of(*option);
      if (value.choices.empty() && listed_kind(value.type).empty()) continue;
      std::vector<std::string> patterns;
      for (const std::string& name : dashed_names(*option))
        patterns.push_back("'" + path_of(command) + " " + name + "'");
      out += "    " + joined(patterns, "|") + ") " + words.offer(value) + " ;;\n";
    }
  });
  return out;
}

// The same for arguments.
std::string argument_cases(const CLI::App& root, const ShellWords& words) {
  std::string out;
  for_each_command(root, [&](const CLI::App& command) {
    for (const CLI::Option* option : command.get_options()) {
      const OptionValue value = value_of(*option);
      if (!option->get_positional() || (value.choices.empty() && listed_kind(value.type).empty())) continue;
      out += "    '" + path_of(command) + "') " + words.offer(value) + " ;;\n";
    }
  });
  return out;
}

// Which words lead to which command: `case "$command/$word"`.
std::string path_cases(const CLI::App& root) {
  std::vector<std::string> steps;
  for_each_command(root, [&](const CLI::App& command) {
    for (const CLI::App* sub : subcommands(&command))
      steps.push_back("'" + path_of(command) + "/" + sub->get_name() + "'");
  });
  return joined(steps, "|");
}

}  // namespace

std::string bash_completion(const CLI::App& root) {
  std::string words;
  for_each_command(root, [&](const CLI::App& command) {
    std::vector<std::string> names;
    for (const CLI::App* sub : subcommands(&command)) names.push_back(sub->get_name());
    std::vector<std::string> options;
    for (const CLI::Option* option : options_of(command)) {
      for (const std::string& name : dashed_names(*option)) options.push_back(name);
    }
    words += "    '" + path_of(command) + "') commands='" + joined(names, " ") + "' options='" +
             joined(options, " ") + "' ;;\n";
  });
  return R"(# bash completion of trunnion, made by the program itself (`trunnion texts completion bash`)
_trunnion_names() {
  trunnion texts names "$1" 2>/dev/null
}

_trunnion() {
  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command='' word commands='' options='' values='' files='' i
  for ((i = 1; i < COMP_CWORD; i++)); do
    word=${COMP_WORDS[i]}
    case "$command/$word" in
    )" + path_cases(root) +
         R"() command=${command:+$command }$word ;;
    esac
  done
  COMPREPLY=()
  case "$command $before" in
)" + value_cases(root, kBash) +
         R"(  esac
  case "$command" in
)" + words +
         R"(  esac
  if [[ -n $values ]]; then
    # A name may be a file's, too.
    mapfile -t COMPREPLY < <(compgen -W "$values" -- "$current"; [[ -z $files ]] || compgen -f -- "$current")
  elif [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
  else
    case "$command" in
)" + argument_cases(root, kBash) +
         R"(    esac
    mapfile -t COMPREPLY < <(compgen -W "$commands $values" -- "$current"; compgen -f -- "$current")
  fi
  # Names with a colon are several words to bash.
  if [[ $current == *:* ]] && declare -F __ltrim_colon_completions >/dev/null; then
    __ltrim_colon_completions "$current"
  fi
}
complete -o bashdefault -o default -o filenames -F _trunnion trunnion
)";
}

std::string zsh_completion(const CLI::App& root) {
  std::string words;
  for_each_command(root, [&](const CLI::App& command) {
    words += "    '" + path_of(command) + "')\n";
    for (const CLI::App* sub : subcommands(&command))
      words += "      commands+=(" + quoted_line(sub->get_name() + ":" + sub->get_description()) + ")\n";
    for (const CLI::Option* option : options_of(command)) {
      for (const std::string& name : dashed_names(*option))
        words += "      options+=(" + quoted_line(name + ":" + option->get_description()) + ")\n";
    }
    words += "      ;;\n";
  });
  return R"(#compdef trunnion
# zsh completion of trunnion, made by the program itself (`trunnion texts completion zsh`)
_trunnion() {
  local command='' files='' word i
  local -a commands options values
  for ((i = 2; i < CURRENT; i++)); do
    word=$words[i]
    case "$command/$word" in
    )" + path_cases(root) +
         R"() command=${command:+$command }$word ;;
    esac
  done
  case "$command $words[CURRENT-1]" in
)" + value_cases(root, kZsh) +
         R"(  esac
  case "$command" in
)" + words +
         R"(  esac
  if (( $#values )); then
    compadd -a values
    [[ -z $files ]] || _files
  elif [[ $words[CURRENT] == -* ]]; then
    _describe option options
  else
    case "$command" in
)" + argument_cases(root, kZsh) +
         R"(    esac
    (( $#commands )) && _describe command commands
    (( $#values )) && compadd -a values
    _files
  fi
}
_trunnion "$@"
)";
}

std::string fish_completion(const CLI::App& root) {
  std::string out =
      R"(# fish completion of trunnion, made by the program itself (`trunnion texts completion fish`)
function __trunnion_at
    set -l command ''
    for word in (commandline -opc)[2..-1]
        switch "$command/$word"
            case )";
  std::string steps = path_cases(root);
  std::replace(steps.begin(), steps.end(), '|', ' ');
  out += steps + R"(
                set command (string trim "$command $word")
        end
    end
    test "$command" = "$argv[1]"
end
)";
  for_each_command(root, [&](const CLI::App& command) {
    const std::string at =
        "complete -c trunnion -n " + fish_quoted("__trunnion_at \"" + path_of(command) + "\"");
    for (const CLI::App* sub : subcommands(&command))
      out += at + " -a " + sub->get_name() + " -d " + fish_quoted(sub->get_description()) + "\n";
    const auto offers = [&](const OptionValue& value) {
      const std::string kind = listed_kind(value.type);
      if (!kind.empty()) return " -a '(trunnion texts names " + kind + ")'";
      return value.choices.empty() ? std::string() : " -a " + fish_quoted(joined(value.choices, " "));
    };
    for (const CLI::Option* option : command.get_options()) {
      if (!option->get_positional()) continue;
      if (const std::string what = offers(value_of(*option)); !what.empty()) out += at + what + "\n";
    }
    for (const CLI::Option* option : options_of(command)) {
      const OptionValue value = value_of(*option);
      out += at;
      for (const std::string& name : option->get_snames()) out += " -s " + name;
      for (const std::string& name : option->get_lnames()) out += " -l " + name;
      if (!value.type.empty()) out += (value.choices.empty() ? " -r" : " -x") + offers(value);
      out += " -d " + fish_quoted(option->get_description()) + "\n";
    }
  });
  return out;
}

}  // namespace trunnion::app
