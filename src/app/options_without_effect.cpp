#include "app/options_without_effect.hpp"

#include <algorithm>
#include <array>
#include <spdlog/spdlog.h>
#include <string>
#include <string_view>

namespace trunnion::app {
namespace {

// An option, and those of which it needs one.
struct Needs {
  std::string_view option;
  std::array<std::string_view, 2> one_of;
};

constexpr std::array<Needs, 8> kNeeds = {{{"--pole-cone-deg", {"--pole-tolerance-deg"}},
                                          {"--pole-min-turn-deg", {"--pole-tolerance-deg"}},
                                          {"--thermal-clamp-um", {"--offsets", "--thermal"}},
                                          {"--thermal-slew-um-s", {"--offsets", "--thermal"}},
                                          {"--thermal-dead-band-um", {"--offsets", "--thermal"}},
                                          {"--largest-correction-mm", {"--model"}},
                                          {"--no-geometric", {"--model"}},
                                          {"--numbers-unit", {"--numbers"}}}};

bool is_given(const CLI::App& command, std::string_view name) {
  const CLI::Option* option = name.empty() ? nullptr : command.get_option_no_throw(std::string(name));
  return option != nullptr && option->count() > 0;
}

// `verify` judges values at run time by the thermal limits, whether it is given offsets or not.
bool has_all(const CLI::App& command, const Needs& needs) {
  return std::all_of(needs.one_of.begin(), needs.one_of.end(), [&](std::string_view name) {
    return name.empty() || command.get_option_no_throw(std::string(name)) != nullptr;
  });
}

void warn_of(const CLI::App& command) {
  for (const Needs& needs : kNeeds) {
    if (!has_all(command, needs) || !is_given(command, needs.option) ||
        std::any_of(needs.one_of.begin(), needs.one_of.end(),
                    [&](std::string_view name) { return is_given(command, name); }))
      continue;
    std::string others;
    for (const std::string_view name : needs.one_of) {
      if (name.empty()) continue;
      others += (others.empty() ? "" : " or ") + std::string(name);
    }
    spdlog::warn("warning: {} has no effect without {}", needs.option, others);
  }
}

}  // namespace

void warn_of_options_without_effect(const CLI::App& root) {
  const CLI::App* command = &root;
  for (auto below = root.get_subcommands(); !below.empty(); below = command->get_subcommands()) {
    command = below.front();
    warn_of(*command);
  }
}

}  // namespace trunnion::app
