#pragma once
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/texts.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/effects/control_tables.hpp"

namespace trunnion::formats {

/// A line of text with its number, ends and surrounding blanks removed.
struct Line {
  std::string_view text;
  std::uint32_t number = 0;
};
std::vector<Line> lines_of(std::string_view text);
/// Words between any of `separators`.
std::vector<std::string_view> words_of(std::string_view text, std::string_view separators = " \t,;");

/// The number of a word, or a finding and nothing.
std::optional<double> number_of(std::string_view word, const std::string& file, std::uint32_t line,
                                Diagnostics& diagnostics);

/// Printed unit of an axis' positions: mm or degrees.
inline double position_factor(const Axis& axis) {
  return axis.kind == AxisKind::rotary ? kRadPerDegree : 1.0;
}
bool is_rotary(const Machine& machine, std::string_view axis);

/// The control's axis numbers, from 1.
std::vector<std::string> axis_numbers(const Machine& machine, const FormatOptions& options);
std::optional<std::size_t> number_of_axis(const Machine& machine, const FormatOptions& options,
                                          std::string_view axis);

/// The step of equidistant nodes; fails when they are not (relative tolerance 1e-9).
Result<double> equal_step(const std::vector<double>& nodes, const std::string& what);

/// A number with up to nine decimals and no trailing zeros: what controls take.
std::string plain(double value);

inline tl::unexpected<Error> refuse(std::string message) {
  return fail(ErrorCode::wrong_input, std::move(message));
}

// One file per format: the only places in the sources where a control is named.
TableFormat isg_format();
TableFormat etalon_format();
TableFormat siemens_format();
TableFormat linuxcnc_format();
TableFormat heidenhain_format();
TableFormat fanuc_format();
TableFormat aerotech_format();

}  // namespace trunnion::formats
