#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::trace {

/// One row of a trace: where the axes stood at one moment.
struct Sample {
  double time_s = 0.0;        // by the clock of the trace
  JointVector q;              // as Trace::positions says; mm, rad
  std::uint32_t nc_line = 0;  // line of the program that the row names; 0: none
  std::uint32_t file_line = 0;
};

/// What the positions of a trace are. joints: of the axes themselves, those of the spindle's gauge point in
/// machine coordinates, as the machine file has them (joint positions of a control without kinematics of its
/// own are these, where its work offset stands as the program's head asks). words: as the program's words,
/// tool length and work offset taken off.
enum class Positions : std::uint8_t { joints, words };

/// Positions of all axes of a machine over time, as a control or a scale recorded them.
struct Trace {
  std::string file;
  Positions positions = Positions::joints;
  bool has_blocks = false;
  std::vector<Sample> samples;  // times increase
  std::size_t rows = 0;         // of the file
  std::size_t incomplete = 0;   // rows with an empty field, left out
  /// Between two values of an axis, usually, where each axis was recorded at moments of its own and the
  /// others stand straight between their values; 0: a row is of one moment.
  double apart_s = 0.0;
};

/// Reads a trace: CSV with a header, `time_s`, a column for every axis of the machine (`X_mm`, `A_deg`, ...),
/// optionally `block`, the line of the program that is run (0 or empty: none). A comment `# positions: words`
/// or `# positions: joints` says what the positions are, `# values apart: 0.02 s` that a row is not of one
/// moment (Trace::apart_s). Columns that nobody knows are left out with a warning. Errors, with
/// file:line:column: a column that is missing, no number, times that go back, fewer than ten rows.
Result<Trace> parse_trace(std::string_view text, const std::string& file, const Machine& machine,
                          Diagnostics& diagnostics);

/// `trace` as such a file; `comments` go first, a line each.
std::string trace_text(const Trace& trace, const Machine& machine,
                       const std::vector<std::string>& comments = {});

/// Samples of a control's own list of values: a line a sample, fields parted by blanks, tabs, commas or
/// semicolons, no header. Where semicolons or tabs part them a comma is that of a decimal.
struct ListImport {
  /// Names of the fields in their order: `time_s`, `time_ms`, `sample` (a number that counts samples), axis
  /// columns as in a trace, `block`, `-` for a field that is left out.
  std::vector<std::string> columns;
  double period_s = 0.001;  // between two samples that are counted, not timed
};

/// Reads such a list. Lines of words (an overrun that the recorder notes) are left out with a warning.
/// Fails as parse_trace does.
Result<Trace> parse_list(std::string_view text, const std::string& file, const Machine& machine,
                         const ListImport& how, Diagnostics& diagnostics);

/// Text that an MTConnect adapter sends (SHDR): lines `time|key|value|key|value ...`, with every value its
/// own time, or the same for several.
struct ShdrImport {
  struct Item {
    std::string key;     // of the adapter, with or without the device in front
    std::string column;  // as in a trace: X_mm ... C_deg, block
  };
  std::vector<Item> items;
};

/// Reads such a text: a row for every moment at which an axis sent a value, the others between theirs. Times
/// are dates or milliseconds. What is UNAVAILABLE is left out. Fails as parse_trace does, and where no line
/// gives an item.
Result<Trace> parse_shdr(std::string_view text, const std::string& file, const Machine& machine,
                         const ShdrImport& how, Diagnostics& diagnostics);

}  // namespace trunnion::trace
