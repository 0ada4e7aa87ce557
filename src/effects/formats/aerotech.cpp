// Aerotech calibration file, :START2D row column out1 out2 dRow dColumn nColumns, then POSUNIT, CORUNIT,
// OFFSETROW, OFFSETCOL, OUTAXIS3 (a third value in each group), lines of groups (out1 out2), :END. Axis
// numbers count from 1. The table begins at minus the offset. PRIMARY is the axis' own unit, mm of a linear
// axis. Values are corrections added to the commanded position (the real pairs of a stage's map and its table
// show it: the table is the start value minus the map). Held outside.
#include <algorithm>
#include <cmath>
#include <map>

#include "effects/formats/format_support.hpp"

namespace trunnion::formats {
namespace {

constexpr std::string_view kPrimary = "PRIMARY";

struct Header {
  std::vector<double> numbers;
  double unit = 1.0;  // of positions, mm
  double correction_unit = 1.0;
  double offset[2] = {0.0, 0.0};  // row, column
  bool primary = false;           // a unit is the axis' own
  std::optional<double> third_output;
};

// METRIC, METRIC/1000, ENGLISH, PRIMARY/1000
std::optional<double> unit_of(std::string_view text) {
  const auto slash = text.find('/');
  const std::string_view name = text.substr(0, slash);
  const double base = name == "METRIC" || name == kPrimary ? 1.0 : name == "ENGLISH" ? kMmPerInch : 0.0;
  const ParsedNumber divisor =
      slash == std::string_view::npos ? ParsedNumber{1.0} : parse_number(text.substr(slash + 1));
  if (base == 0.0 || !divisor || divisor.value <= 0.0) return std::nullopt;
  return base / divisor.value;
}

void keys_of(std::string_view text, const std::string& file, std::uint32_t line, Header& header,
             Diagnostics& diagnostics) {
  std::string joined;  // "OFFSETROW = 260.000" -> "OFFSETROW=260.000"
  for (const auto w : words_of(text, " \t"))
    joined += (w.starts_with('=') || joined.ends_with('=') ? "" : " ") + std::string(w);
  for (const auto w : words_of(joined, " ")) {
    const auto equals = w.find('=');
    if (equals == std::string_view::npos) {
      diagnostics.error(
          file, {line, 1},
          w == "NEGCOR"
              ? "NEGCOR is not read: take it out, and give --negate where corrections have the other sign"
              : "expected KEY=value, found '" + std::string(w) + "'");
      continue;
    }
    const std::string_view key = w.substr(0, equals), value = w.substr(equals + 1);
    if (key == "POSUNIT" || key == "CORUNIT") {
      const auto unit = unit_of(value);
      if (!unit)
        diagnostics.error(file, {line, 1}, "unknown unit '" + std::string(value) + "'");
      else
        (key == "POSUNIT" ? header.unit : header.correction_unit) = *unit;
      header.primary = header.primary || value.starts_with(kPrimary);
    } else if (key == "OUTAXIS3") {
      header.third_output = number_of(value, file, line, diagnostics);
    } else if (key == "OFFSETROW" || key == "OFFSETCOL") {
      header.offset[key == "OFFSETCOL"] = number_of(value, file, line, diagnostics).value_or(0.0);
    }
  }
}

Result<ControlTables> read_aerotech(std::string_view text, const std::string& file, const Machine& machine,
                                    const FormatOptions& options, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.error_count();
  Header header;
  std::vector<std::vector<double>> rows;
  bool is_whole = false;
  for (const Line& line : lines_of(text)) {
    const std::string_view content = trim(line.text.substr(0, line.text.find_first_of(";'")));
    is_whole = is_whole || content.starts_with(":END");
    if (content.empty() || content.starts_with(":END")) continue;
    if (content.starts_with(":START2D")) {
      const std::string_view rest = trim(content.substr(8));
      if (rest.find('=') != std::string_view::npos)
        keys_of(rest, file, line.number, header, diagnostics);
      else if (header.numbers.empty())
        for (const auto w : words_of(rest))
          header.numbers.push_back(number_of(w, file, line.number, diagnostics).value_or(0.0));
      else
        diagnostics.error(file, {line.number, 1}, "a second table; one is read");
      continue;
    }
    if (content.starts_with(':')) {
      diagnostics.error(file, {line.number, 1}, "only :START2D is read");
      continue;
    }
    rows.emplace_back();
    for (const auto w : words_of(content))
      rows.back().push_back(number_of(w, file, line.number, diagnostics).value_or(0.0));
  }
  if (header.numbers.size() < 6)
    return fail(ErrorCode::wrong_input, "no :START2D line with axes, steps and columns", file);
  if (!is_whole) diagnostics.error(file, {}, "the table ends without :END: it is cut off");
  if (header.third_output) header.numbers.insert(header.numbers.end() - 3, *header.third_output);
  const std::size_t outputs = header.numbers.size() - 5;
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  constexpr double kMostColumns = 1e6;
  const double count = header.numbers.back();
  if (!(count >= 2.0 && count <= kMostColumns) || count != std::floor(count) || rows.size() < 2)
    return fail(ErrorCode::wrong_input,
                "the table has " + std::to_string(rows.size()) + " rows of " + plain(count) +
                    " columns: 2 and more, at most 1000000, expected",
                file);
  const auto columns = static_cast<std::size_t>(count);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() != columns * outputs)
      return fail(ErrorCode::wrong_input,
                  "row " + std::to_string(i + 1) + " of the table has " + std::to_string(rows[i].size()) +
                      " values, expected " + std::to_string(columns * outputs),
                  file);
  }
  const auto names = axis_numbers(machine, options);
  const auto axis = [&](double number) {
    for (std::size_t k = 0; k < names.size(); ++k) {
      if (number == static_cast<double>(k + 1) && machine.axis(names[k])) return names[k];
    }
    return std::string();
  };
  CorrectionMap map;
  // Rows of the file go along its row axis: the second argument here runs fastest, as in the file.
  map.inputs = {axis(header.numbers[0]), axis(header.numbers[1])};
  for (std::size_t k = 0; k < outputs; ++k) map.outputs.push_back({axis(header.numbers[2 + k]), {}, {}});
  const auto unknown = [](const CorrectionMap::Output& output) { return output.axis.empty(); };
  if (map.inputs[0].empty() || map.inputs[1].empty() ||
      std::any_of(map.outputs.begin(), map.outputs.end(), unknown))
    return fail(ErrorCode::wrong_input, "an axis number of the file is no axis of this machine: give --axes",
                file);
  const auto turns = [&](const std::string& name) { return is_rotary(machine, name); };
  if (header.primary && (turns(map.inputs[0]) || turns(map.inputs[1]) ||
                         std::any_of(map.outputs.begin(), map.outputs.end(),
                                     [&](const auto& output) { return turns(output.axis); })))
    return fail(ErrorCode::wrong_input, "PRIMARY is the unit of each axis: of rotary axes it is not read",
                file);
  map.nodes.resize(2);
  for (std::size_t i = 0; i < rows.size(); ++i)
    map.nodes[0].push_back((static_cast<double>(i) * header.numbers[2 + outputs] - header.offset[0]) *
                           header.unit);
  for (std::size_t j = 0; j < columns; ++j)
    map.nodes[1].push_back((static_cast<double>(j) * header.numbers[3 + outputs] - header.offset[1]) *
                           header.unit);
  const double unit = header.correction_unit * (options.negate ? -1.0 : 1.0);
  for (const std::vector<double>& row : rows) {
    for (std::size_t j = 0; j < columns; ++j)
      for (std::size_t k = 0; k < outputs; ++k) map.outputs[k].up.push_back(unit * row[j * outputs + k]);
  }
  return ControlTables{.errors = {}, .location = {}, .corrections = {map}};
}

Result<std::string> write_aerotech(const ControlTables& tables, const Machine& machine,
                                   const FormatOptions& options) {
  if (tables.corrections.size() != 1 || tables.corrections[0].inputs.size() != 2)
    return refuse("this format holds one table over two axes");
  const CorrectionMap& map = tables.corrections[0];
  const auto number = [&](const std::string& axis) { return number_of_axis(machine, options, axis); };
  for (const auto& output : map.outputs) {
    if (!output.down.empty()) return refuse("this format has no direction");
    if (!number(output.axis)) return refuse("axis " + output.axis + " has no number (give --axes)");
  }
  if (!number(map.inputs[0]) || !number(map.inputs[1]))
    return refuse("an input axis has no number (give --axes)");
  if (is_rotary(machine, map.inputs[0]) || is_rotary(machine, map.inputs[1]))
    return refuse("linear axes only");
  const auto row_step = equal_step(map.nodes[0], "rows"), column_step = equal_step(map.nodes[1], "columns");
  if (!row_step) return tl::unexpected(row_step.error());
  if (!column_step) return tl::unexpected(column_step.error());
  std::string out =
      ":START2D " + std::to_string(*number(map.inputs[0])) + " " + std::to_string(*number(map.inputs[1]));
  for (const auto& output : map.outputs) out += " " + std::to_string(*number(output.axis));
  out +=
      " " + plain(*row_step) + " " + plain(*column_step) + " " + std::to_string(map.nodes[1].size()) + "\n";
  out += ":START2D POSUNIT=METRIC CORUNIT=METRIC/1000 OFFSETROW=" + plain(-map.nodes[0].front()) +
         " OFFSETCOL=" + plain(-map.nodes[1].front()) + "\n\n";
  const double scale = (options.negate ? -1.0 : 1.0) / kMmPerUm;
  for (std::size_t i = 0; i < map.nodes[0].size(); ++i) {
    for (std::size_t j = 0; j < map.nodes[1].size(); ++j)
      for (const auto& output : map.outputs)
        out += (j == 0 && &output == &map.outputs.front() ? "" : "\t") +
               fixed_text(scale * output.up[i * map.nodes[1].size() + j], 4);
    out += "\n";
  }
  return out + "\n:END\n";
}

}  // namespace

TableFormat aerotech_format() {
  return {"aerotech", "Aerotech :START2D: corrections of axes over two axes", true, read_aerotech,
          write_aerotech};
}

}  // namespace trunnion::formats
