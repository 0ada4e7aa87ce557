#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/post/tools.hpp"

namespace trunnion::app {

/// What is known of the tools beside the CL file: shared by every command that posts one or judges a program
/// by it.
struct ToolCliOptions {
  std::string tools;
  std::optional<std::uint32_t> tool;
  std::optional<double> length_mm;
  std::optional<double> flute_mm;

  void add_to(CLI::App& command);
  /// The tool file; nothing without `--tools`.
  Result<std::optional<post::ToolTable>> load(Diagnostics& diagnostics) const;
  /// `table` must outlive what is made with it.
  post::ToolOptions resolve(const std::optional<post::ToolTable>& table) const {
    return {table ? &*table : nullptr, tool, length_mm, flute_mm};
  }
  /// The options as they stand, for "unchanged inputs are skipped".
  std::string text() const;
};

}  // namespace trunnion::app
