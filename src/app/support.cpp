#include "app/support.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <set>
#include <spdlog/spdlog.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"

namespace trunnion::app {
namespace {

std::string& command_line() {
  static std::string line;
  return line;
}

// Who read standard output has read enough (`| head`): nothing to be said.
bool is_closed_pipe(const Error& error) {
  return error.code == ErrorCode::io_failed && error.file == "-" &&
         error.message.ends_with(std::strerror(EPIPE));  // NOLINT(concurrency-mt-unsafe)
}

spdlog::level::level_enum level_of(Severity severity) {
  if (severity == Severity::error) return spdlog::level::err;
  return severity == Severity::warning ? spdlog::level::warn : spdlog::level::info;
}

}  // namespace

void remember_command_line(int argc, const char* const* argv) {
  command_line() = "trunnion";
  for (int i = 1; i < argc; ++i) command_line() += std::string(" ") + argv[i];
}

CLI::Validator above_zero() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        const auto number = parse_number(text);
        if (!number) return text + " is not a number";
        if (number.value > kLargestOption) return text + " is beyond " + shortest_text(kLargestOption);
        return number.value > 0.0 ? "" : text + " is not above 0";
      },
      "POSITIVE");
}

CLI::Validator between(double low, double high) {
  const std::string range = shortest_text(low) + " to " + shortest_text(high);
  return CLI::Validator(
      [=](const std::string& text) -> std::string {
        const auto number = parse_number(text);
        if (!number) return text + " is not a number";
        return number.value >= low && number.value <= high ? "" : text + " is not in " + range;
      },
      range);
}

std::string made_by() {
  return std::string("trunnion ") + TRUNNION_VERSION + ": " + command_line();
}

ExitCode exit_code(ErrorCode code) {
  return static_cast<ExitCode>(static_cast<int>(code));
}

void print(const Diagnostics& diagnostics) {
  // A file that is read for each of several programs has the same findings each time; one of the wrong kind
  // has one in every row.
  constexpr std::size_t kMost = 20;  // of a file and a severity: a screen
  std::set<std::string> said;
  std::map<std::pair<std::string, Severity>, std::size_t> count;
  for (const Finding& finding : diagnostics.findings()) {
    if (count[{finding.file, finding.severity}] > kMost || !said.insert(finding.text()).second) continue;
    if (++count[{finding.file, finding.severity}] > kMost) {
      spdlog::log(level_of(finding.severity), "{}: {} more of this kind are not listed", finding.file,
                  finding.severity == Severity::error     ? "error:"
                  : finding.severity == Severity::warning ? "warning:"
                                                          : "note:");
      continue;
    }
    spdlog::log(level_of(finding.severity), "{}", finding.text());
  }
}

ExitCode print_error(const Error& error) {
  if (!is_closed_pipe(error)) spdlog::error("{}", error.text());
  return exit_code(error.code);
}

ExitCode print_failure(const Diagnostics& diagnostics, const Error& error) {
  print(diagnostics);
  const auto& findings = diagnostics.findings();
  const bool said = std::any_of(findings.begin(), findings.end(),
                                [&](const Finding& f) { return f.text() == error.text(); });
  return said ? exit_code(error.code) : print_error(error);
}

ExitCode write_output(const std::string& path, const std::string& text) {
  const auto written = write_file(path, text);
  return written ? kDone : print_error(written.error());
}

}  // namespace trunnion::app
