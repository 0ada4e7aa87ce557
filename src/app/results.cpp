#include "app/results.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "trunnion/base/failure.hpp"
#include "trunnion/base/files.hpp"
#include "trunnion/base/printable.hpp"

namespace trunnion::app {
namespace {

namespace fs = std::filesystem;

bool is_device(const std::string& file) {
  std::error_code ec;
  const fs::file_status status = fs::status(file, ec);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

}  // namespace

std::string text_of_file(const std::string& file) {
  constexpr std::uintmax_t kMost = 256'000'000;  // of a million blocks; a page holds an excerpt of that
  std::error_code ec;
  if (file.empty() || file == "-" || !fs::is_regular_file(file, ec) || fs::file_size(file, ec) > kMost)
    return "";
  auto text = read_file(file);
  if (!text) throw Failure(text.error());
  return std::move(*text);
}

void ResultOptions::add_to(CLI::App& command) {
  command.add_option("--json", json, "write the result as JSON to this file (- is standard output)");
  command.add_option("--report", report, "write a self-contained HTML page");
}

Result<void> ResultOptions::apart_from(const std::string& output, const std::vector<std::string>& taken,
                                       const std::vector<std::pair<std::string, std::string>>& more) const {
  std::set<std::string> kept;
  for (const std::string& file : taken) {
    if (!file.empty() && file != "-") kept.insert(resolved_path(file));
  }
  std::vector<std::pair<std::string, std::string>> written = {
      {"-o", output}, {"--json", json}, {"--report", report}};
  written.insert(written.end(), more.begin(), more.end());
  std::map<std::string, std::string> outputs;  // place, option
  for (const auto& [option, file] : written) {
    if (file.empty() || is_device(file)) continue;
    const auto place = file == "-" ? file : resolved_path(file);
    const auto [other, is_new] = outputs.emplace(place, option);
    if (!is_new && file == "-") {
      return fail(ErrorCode::wrong_use,
                  other->second + " - and " + option + " - both want standard output; name a file for one");
    }
    if (!is_new) {
      return fail(ErrorCode::wrong_use, other->second + " and " + option + " name the same file " + file);
    }
    if (file != "-" && kept.contains(place)) {
      return fail(ErrorCode::wrong_use,
                  option + " would overwrite " + file + ", which this command reads or writes");
    }
  }
  return {};
}

Result<std::vector<BodyMesh>> ResultOptions::bodies_of(const Machine& machine,
                                                       Diagnostics& diagnostics) const {
  return report.empty() ? std::vector<BodyMesh>{} : load_body_meshes(machine, diagnostics);
}

ExitCode ResultOptions::write(const std::string& result_json, const std::function<report::Page()>& page,
                              const std::string& text) const {
  if (!json.empty()) {
    if (const ExitCode code = write_output(json, printable_json(result_json)); code != kDone) return code;
  }
  if (!report.empty()) {
    if (const ExitCode code = write_output(report, report::page_html(page())); code != kDone) return code;
  }
  return json_on_stdout() || text.empty() ? kDone : write_output("-", printable(text, "\n\t"));
}

ExitCode ResultOptions::write(const std::string& result_json, report::ResultText said, report::PageOf page,
                              const std::string& text) const {
  said.json = result_json;
  said.made_by = made_by();
  return write(
      result_json, [&] { return page(said); }, text);
}

}  // namespace trunnion::app
