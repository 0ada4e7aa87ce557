#include "app/command_tree.hpp"

namespace trunnion::app {

std::vector<const CLI::App*> subcommands(const CLI::App* command) {
  return command->get_subcommands([](const CLI::App* app) { return !app->get_group().empty(); });
}

std::string full_name(const CLI::App* command) {
  const CLI::App* parent = command->get_parent();
  return parent == nullptr ? command->get_name() : full_name(parent) + " " + command->get_name();
}

std::string names_of(const CLI::Option& option) {
  return option.get_name(option.get_positional(), !option.get_positional());
}

OptionValue value_of(const CLI::Option& option) {
  OptionValue out;
  if (option.get_items_expected_max() == 0) return out;
  out.standard = option.get_default_str();
  const std::string type = option.get_type_name();  // TEXT:{a,b}, FLOAT:POSITIVE
  const auto colon = type.find(':');
  out.type = type.substr(0, colon);
  if (colon == std::string::npos) return out;
  const std::string rest = type.substr(colon + 1);
  if (!rest.starts_with('{') || !rest.ends_with('}')) {
    out.limits = rest;
    return out;
  }
  for (std::size_t at = 1; at < rest.size();) {
    const auto end = rest.find_first_of(",}", at);
    out.choices.push_back(rest.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

}  // namespace trunnion::app
