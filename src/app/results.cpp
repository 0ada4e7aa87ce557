#include "app/results.hpp"

#include "trunnion/report/result_page.hpp"

namespace trunnion::app {

void ResultOptions::add_to(CLI::App& command) {
  command.add_option("--json", json, "write the result as JSON to this file (- is standard output)");
  command.add_option("--report", report, "write a self-contained HTML page");
}

Result<void> ResultOptions::apart_from(const std::string& output) const {
  if (output == "-" && json_on_stdout())
    return fail(ErrorCode::wrong_use, "-o - and --json - both want standard output; name a file for one");
  return {};
}

ExitCode ResultOptions::write(const std::string& result_json, const std::function<report::Page()>& page,
                              const std::string& text) const {
  if (!json.empty()) {
    if (const ExitCode code = write_output(json, result_json); code != kDone) return code;
  }
  if (!report.empty()) {
    if (const ExitCode code = write_output(report, report::page_html(page())); code != kDone) return code;
  }
  return json_on_stdout() || text.empty() ? kDone : write_output("-", text);
}

ExitCode ResultOptions::write(const std::string& result_json, const std::string& title,
                              const std::string& verdict, const std::string& text) const {
  return write(
      result_json, [&] { return report::result_page(title, verdict, result_json, made_by()); }, text);
}

}  // namespace trunnion::app
