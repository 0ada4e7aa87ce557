// Heidenhain .COM: columns AXISPOS, BACKLASH and one for each axis that depends on the axis to which the .CMA
// file assigns the table. Values are errors: "the error is positive if the table travel is too long"
// (Technical Manual TNC 407, MP720 and the figure of the non-linear compensation), so minus the correction;
// BACKLASH holds the values of the negative direction for the axis itself. The manual at hand says the sign
// of the linear error in words and of the non-linear one in a figure only: negate when a first test says so.
#include <algorithm>

#include "effects/formats/format_support.hpp"

namespace trunnion::formats {
namespace {

Result<ControlTables> read_heidenhain(std::string_view text, const std::string& file, const Machine& machine,
                                      const FormatOptions& options, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.error_count();
  const double sign = options.negate ? 1.0 : -1.0;
  std::string input = options.input_axis;
  std::vector<std::string> columns;
  CorrectionMap map;
  map.nodes.emplace_back();
  std::vector<std::vector<double>> values;
  bool is_whole = false;
  for (const Line& line : lines_of(text)) {
    const auto words = words_of(line.text, " \t");
    is_whole = is_whole || (!words.empty() && words[0] == "[END]");
    if (words.empty() || words[0] == "[END]") continue;
    if (words[0] == "BEGIN") {
      if (words.back() == "INCH")
        diagnostics.error(file, {line.number, 1},
                          "the table is in inches: only tables in mm are read (BEGIN NAME.COM MM)");
      if (input.empty() && words.size() > 1) input = std::string(words[1].substr(0, words[1].find('.')));
      continue;
    }
    if (columns.empty()) {
      columns.assign(words.begin(), words.end());
      values.resize(columns.size());
      if (std::find(columns.begin(), columns.end(), "AXISPOS") == columns.end())
        diagnostics.error(file, {line.number, 1}, "column AXISPOS is missing");
      continue;
    }
    if (words.size() != columns.size()) {
      diagnostics.error(file, {line.number, 1},
                        "row has " + std::to_string(words.size()) + " fields, the header has " +
                            std::to_string(columns.size()));
      continue;
    }
    for (std::size_t k = 0; k < columns.size(); ++k)
      values[k].push_back(number_of(words[k], file, line.number, diagnostics).value_or(0.0));
  }
  if (!machine.axis(input))
    return fail(ErrorCode::wrong_use, "the file does not say which axis it is assigned to: give --axis",
                file);
  if (columns.empty()) diagnostics.error(file, {1, 1}, "no header");
  if (!is_whole) diagnostics.error(file, {}, "the table ends without [END]: it is cut off");
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  const double factor = position_factor(machine.axes[*machine.axis(input)]);
  map.inputs = {input};
  std::vector<double> backlash;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (columns[k] == "AXISPOS") {
      for (const double v : values[k]) map.nodes[0].push_back(v * factor);
    } else if (columns[k] == "BACKLASH") {
      for (const double v : values[k]) backlash.push_back(sign * v * factor);
    } else if (const auto id = machine.axis(columns[k])) {
      CorrectionMap::Output output{.axis = columns[k], .up = {}, .down = {}};
      for (const double v : values[k]) output.up.push_back(sign * v * position_factor(machine.axes[*id]));
      map.outputs.push_back(output);
    } else if (columns[k] != "NR") {
      return fail(ErrorCode::wrong_input, "column '" + columns[k] + "' is no axis of this machine", file);
    }
  }
  for (auto& output : map.outputs)
    if (output.axis == input &&
        std::any_of(backlash.begin(), backlash.end(), [](double v) { return v != 0.0; }))
      output.down = backlash;
  if (map.nodes[0].size() < 2 || map.outputs.empty())
    return fail(ErrorCode::wrong_input, "the table is empty", file);
  return ControlTables{.errors = {}, .location = {}, .corrections = {map}};
}

Result<std::string> write_heidenhain(const ControlTables& tables, const Machine& machine,
                                     const FormatOptions& options) {
  if (tables.corrections.size() != 1 || tables.corrections[0].inputs.size() != 1)
    return refuse("this format holds one table over one axis");
  const CorrectionMap& map = tables.corrections[0];
  const double sign = options.negate ? 1.0 : -1.0;
  const double factor = position_factor(machine.axes[*machine.axis(map.inputs[0])]);
  std::string out = "BEGIN " + map.inputs[0] + ".COM MM\nNR\tAXISPOS\tBACKLASH";
  for (const auto& output : map.outputs) out += "\t" + output.axis;
  out += "\n";
  const auto* own = map.output(map.inputs[0]);
  for (const auto& output : map.outputs)
    if (&output != own && !output.down.empty())
      return refuse("this format holds the negative direction of " + map.inputs[0] + " itself only, not of " +
                    output.axis);
  for (std::size_t i = 0; i < map.nodes[0].size(); ++i) {
    out += std::to_string(i) + "\t" + plain(map.nodes[0][i] / factor) + "\t" +
           (own != nullptr && !own->down.empty() ? plain(sign * own->down[i] / factor) : "0");
    for (const auto& output : map.outputs)
      out += "\t" + plain(sign * output.up[i] / position_factor(machine.axes[*machine.axis(output.axis)]));
    out += "\n";
  }
  return out + "[END]\n";
}

}  // namespace

TableFormat heidenhain_format() {
  return {"heidenhain", "Heidenhain .COM: errors of axes over one axis, BACKLASH for its negative direction",
          true, read_heidenhain, write_heidenhain};
}

}  // namespace trunnion::formats
