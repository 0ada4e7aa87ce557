#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/result.hpp"

namespace trunnion {

/// A value as a source named and wrote it: units and meaning are the reader's to know.
struct LiveValue {
  std::string item;
  std::string text;
};

/// One line of an MTConnect adapter (SHDR, part 5 of MTConnect before 2.0: `time|item|value|item|value...`).
struct ShdrLine {
  std::string time;  // as it is written: a date, a number of the adapter's own clock, or nothing
  std::vector<LiveValue> values;
  std::optional<double> heartbeat_s;  // of `* PONG ms`: the adapter answers a PING at least so often
};

/// Whether a line is one of an adapter and not JSON or XML: a command begins with `*`, data has bars.
bool is_shdr(std::string_view line);

/// Reads a line of data or a command; commands other than PONG, and assets (`@...@`), hold no values. A line
/// that belongs to a condition or a message gives pairs of its fields, of which no item is ever looked for.
/// Fails (wrong_input) on data that does not begin with its time (which may be empty).
Result<ShdrLine> parse_shdr_line(std::string_view line);

}  // namespace trunnion
