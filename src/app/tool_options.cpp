#include "app/tool_options.hpp"

#include "trunnion/base/number_text.hpp"

#include "app/support.hpp"

namespace trunnion::app {

namespace {

// Longer than any tool that turns on such machines: another unit was meant.
constexpr double kLongestFlute_mm = 1000.0;

}  // namespace

void ToolCliOptions::add_to(CLI::App& c) {
  c.add_option("--tools", tools,
               "tool file: CSV with tool, length_mm (and radius_mm, flute_length_mm, register), or a tool "
               "table tool.tbl (T, Z, D). Tools not in it: length of LOADTL/n,LENGTH,l, else "
               "--tool-length-mm, else the machine file's");
  c.add_option("--tool", tool, "tool number to load at the start, for a CL file that loads no tool")
      ->check(CLI::Range(std::uint32_t{0}, std::uint32_t{99999999}));
  c.add_option(
       "--tool-length-mm", length_mm,
       "gauge length of tools without one in the tool file or LOADTL. If the CL file loads no tool and "
       "--tool is not given: X Y Z are positions of the spindle's gauge point, length compensation off")
      ->check(above_zero());
  c.add_option("--flute-length-mm", flute_mm,
               "hold the tolerance for every point of the tool from its tip to this length along its axis; "
               "0: for the tip alone (default: flute_length_mm of the tool file, else the height of CUTTER's "
               "seven numbers in the CL file, else 0)")
      ->check(CLI::Range(0.0, kLongestFlute_mm));
}

Result<std::optional<post::ToolTable>> ToolCliOptions::load(Diagnostics& diagnostics) const {
  if (tools.empty()) return std::nullopt;
  auto table = post::load_tools(tools, diagnostics);
  if (!table) return tl::unexpected(table.error());
  return std::optional(std::move(*table));
}

std::string ToolCliOptions::text() const {
  return "tools " + tools + " " + (tool ? std::to_string(*tool) : "-") + " " +
         (length_mm ? shortest_text(*length_mm) : "-") + " " + (flute_mm ? shortest_text(*flute_mm) : "-");
}

}  // namespace trunnion::app
