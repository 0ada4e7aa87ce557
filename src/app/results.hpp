#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "trunnion/report/command_pages.hpp"
#include "trunnion/report/page.hpp"

#include "app/support.hpp"

namespace trunnion::app {

/// The text of a file that a page shows; empty when it is no regular file, or too long to be shown. Throws
/// Failure when it cannot be read.
std::string text_of_file(const std::string& file);

/// `--json` and `--report` of every command.
struct ResultOptions {
  std::string json;
  std::string report;
  void add_to(CLI::App& command);
  /// Standard output belongs to the JSON object.
  bool json_on_stdout() const { return json == "-"; }
  /// Fails with wrong_use when the JSON or the page is one of `taken`, which the command reads or writes
  /// without naming them (check_options_together knows those that it names).
  Result<void> apart_from(const std::vector<std::string>& taken) const;
  /// The shapes of the machine file that the page shows; none where no page is asked for.
  Result<std::vector<BodyMesh>> bodies_of(const Machine& machine, Diagnostics& diagnostics) const;
  /// Writes what is asked for: the JSON, the page, and `text` (for people, none when empty) to standard
  /// output unless the JSON stands there. `page` is only made where it is asked for.
  ExitCode write(const std::string& result_json, const std::function<report::Page()>& page,
                 const std::string& text = "") const;
  /// The same with the page of the command, made of its JSON: `said` lacks that and `made_by`.
  ExitCode write(const std::string& result_json, report::ResultText said, report::PageOf page,
                 const std::string& text) const;
};

}  // namespace trunnion::app
