#pragma once
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/nc/axis_words.hpp"

namespace trunnion::probe {

/// One line of a control's log: where the axes stood when the probe was touched, as the control counts them
/// (mm, rad). X, Y and Z are always known.
struct LogLine {
  std::array<std::optional<double>, nc::kAxisLetters> at;
  std::string text;
  std::uint32_t line = 0;
};

/// A log as a control writes it. Two shapes of a line: numbers alone, the coordinates X Y Z A B C U V W in
/// this order (at least three), or each number behind the letter of its axis, with or without blanks and an
/// equals sign
/// (`X 12.3450 Y-1.0000 Z...`). Lines of nothing but `%` and empty ones are passed over.
struct TouchLog {
  std::vector<LogLine> lines;
  /// A line that is none, or the last one where the file is cut in the middle of it: it stands behind
  /// `lines`.
  std::optional<LogLine> broken;
  std::string broken_because;
};
TouchLog parse_touch_log(std::string_view text);

}  // namespace trunnion::probe
