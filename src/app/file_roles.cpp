#include "app/file_roles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/files.hpp"

namespace trunnion::app {
namespace {

namespace fs = std::filesystem;

bool has_name(const CLI::Option& option, std::string_view name) {
  const auto& names = option.get_lnames();
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_written(const CLI::Option& option) {
  constexpr std::array<std::string_view, 5> kWritten = {"output", "json", "report", "model-out", "journal"};
  return option.get_type_name() == kFileToWrite ||
         std::any_of(kWritten.begin(), kWritten.end(), [&](auto name) { return has_name(option, name); });
}

// Names of things, which may be those of files by chance.
bool names_no_file(const CLI::Option& option) {
  return has_name(option, "name") || has_name(option, "program-name");
}

bool writes_its_model_anew(const CLI::App& command) {
  return command.get_parent() != nullptr && command.get_parent()->get_name() == "model" &&
         (command.get_name() == "fit" || command.get_name() == "add");
}

// "-o" where it is that, else "--json".
std::string said_as(const CLI::Option& option) {
  if (!option.get_snames().empty()) return "-" + option.get_snames().front();
  return option.get_name();
}

bool is_regular(const std::string& file) {
  std::error_code ec;
  return fs::is_regular_file(file, ec);
}

bool is_device(const std::string& file) {
  std::error_code ec;
  const fs::file_status status = fs::status(file, ec);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

[[noreturn]] void refuse(const std::string& why) {
  throw CLI::ValidationError("error: " + why, CLI::ExitCodes::ValidationError);
}

void check_numbers(const CLI::Option& option) {
  if (option.get_type_name().find("FLOAT") == std::string::npos) return;
  for (const std::string& text : option.results()) {
    char* end = nullptr;
    const double number = std::strtod(text.c_str(), &end);  // as the option itself reads it
    if (end != text.c_str() && *end == '\0' && !std::isfinite(number))
      refuse(said_as(option) + ": " + text + " is not a finite number");
  }
}

class Files {
 public:
  void take(const CLI::App& command) {
    for (const CLI::Option* option : command.get_options()) {
      if (option->count() == 0) {
        if (is_written(*option) && option->get_default_str() == "-") write(*option, "-");
        continue;
      }
      check_numbers(*option);
      if (is_written(*option)) {
        for (const std::string& file : option->results()) write(*option, file);
      } else if (!names_no_file(*option)) {
        for (const std::string& file : option->results()) read(*option, file);
      }
    }
  }

  void check(const CLI::App& command) const {
    for (const auto& [place, by] : written_) {
      const auto other = read_.find(place);
      if (other == read_.end()) continue;
      if (has_name(*by.option, "output") && has_name(*other->second.option, "model") &&
          writes_its_model_anew(command))
        continue;
      refuse(said_as(*by.option) + " would overwrite " + by.file + ", which this command reads");
    }
  }

 private:
  struct Named {
    const CLI::Option* option;
    std::string file;
  };

  void write(const CLI::Option& option, const std::string& file) {
    std::error_code ec;
    if (file.empty()) refuse(said_as(option) + ": the name of the file is empty");
    if (is_device(file) || fs::is_directory(file, ec)) return;
    const std::string place = file == "-" ? file : resolved_path(file);
    const auto [other, is_new] = written_.emplace(place, Named{&option, file});
    if (is_new) return;
    const std::string first = said_as(*other->second.option);
    if (file == "-")
      refuse(first + " - and " + said_as(option) + " - both want standard output; name a file for one");
    refuse(first + " and " + said_as(option) + " name the same file " + file);
  }

  void read(const CLI::Option& option, const std::string& file) {
    if (file == "-") {
      if (from_standard_input_ != nullptr)
        refuse("two files are read from standard input (-); name one of them");
      from_standard_input_ = &option;
    }
    if (is_regular(file)) read_.emplace(resolved_path(file), Named{&option, file});
  }

  std::map<std::string, Named> written_, read_;  // by place
  const CLI::Option* from_standard_input_ = nullptr;
};

}  // namespace

void check_options_together(const CLI::App& root) {
  Files files;
  const CLI::App* command = &root;
  files.take(root);
  for (auto below = root.get_subcommands(); !below.empty(); below = command->get_subcommands()) {
    command = below.front();
    files.take(*command);
  }
  files.check(*command);
}

}  // namespace trunnion::app
