#include "app/results.hpp"

#include <cstdint>
#include <filesystem>
#include <set>
#include <utility>

#include "trunnion/base/failure.hpp"
#include "trunnion/base/files.hpp"
#include "trunnion/base/printable.hpp"

namespace trunnion::app {
namespace {

namespace fs = std::filesystem;

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

Result<void> ResultOptions::apart_from(const std::vector<std::string>& taken) const {
  std::set<std::string> kept;
  for (const std::string& file : taken) {
    if (!file.empty() && file != "-") kept.insert(resolved_path(file));
  }
  for (const auto& [option, file] : {std::pair("--json", &json), std::pair("--report", &report)}) {
    if (!file->empty() && *file != "-" && kept.contains(resolved_path(*file)))
      return fail(ErrorCode::wrong_use,
                  std::string(option) + " would overwrite " + *file + ", which this command reads or writes");
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
