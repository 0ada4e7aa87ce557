// LinuxCNC [JOINT_n]COMP_FILE: lines `nominal forward reverse`, ascending, at most 256; the first line that
// is no triplet ends the file silently, so that none but triplets are written and every other line is an
// error here. The code (usrmotintf.cc, command.c, control.c) adds a trim to the commanded position: type 1
// lists the trims, type 0 lists actual positions and the trim is nominal - actual. (The example in older help
// texts, `1.00 1.01 0.99` = `1.00 0.01 -0.01`, has the opposite sign.) Held outside; BACKLASH is ignored.
#include "effects/formats/format_support.hpp"

namespace trunnion::formats {
namespace {

constexpr std::size_t kMostEntries = 256;  // EMCMOT_COMP_SIZE

// Read as the other type, corrections grow by the travel itself.
std::optional<std::string> other_type(const std::vector<double>& nodes,
                                      const std::vector<double>& corrections, int file_type) {
  constexpr double kLargestSlope = 0.1;  // of a screw in mm per mm: a hundred times the worst there is
  const double slope = (corrections.back() - corrections.front()) / (nodes.back() - nodes.front());
  if (std::abs(slope) < kLargestSlope) return std::nullopt;
  const std::string other = std::to_string(1 - file_type);
  return "read as type " + std::to_string(file_type) + " (COMP_FILE_TYPE) its corrections change by " +
         fixed_text(std::abs(slope), 3) + " mm in each mm of travel: is it of type " + other +
         "? Give --type " + other;
}

Result<ControlTables> read_linuxcnc(std::string_view text, const std::string& file, const Machine& machine,
                                    const FormatOptions& options, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.error_count();
  if (!machine.axis(options.input_axis))
    return fail(ErrorCode::wrong_use, "this format does not say which axis it is about: give --axis", file);
  const double factor = position_factor(machine.axes[*machine.axis(options.input_axis)]),
               sign = options.negate ? -1.0 : 1.0;
  CorrectionMap map;
  map.inputs = {options.input_axis};
  map.nodes.emplace_back();
  CorrectionMap::Output output{.axis = options.input_axis, .up = {}, .down = {}};
  for (const Line& line : lines_of(text)) {
    if (line.text.empty()) continue;
    const auto words = words_of(line.text, " \t");
    std::optional<double> v[3];
    for (std::size_t k = 0; k < 3 && k < words.size(); ++k)
      v[k] = number_of(words[k], file, line.number, diagnostics);
    if (words.size() < 3)
      diagnostics.error(file, {line.number, 1},
                        "no triplet: the control would end the table here without a word");
    if (!v[0] || !v[1] || !v[2]) continue;
    if (!map.nodes[0].empty() && *v[0] * factor <= map.nodes[0].back())
      diagnostics.error(file, {line.number, 1}, "positions must ascend");
    const double nominal = *v[0];
    map.nodes[0].push_back(nominal * factor);
    output.up.push_back(sign * factor * (options.file_type == 0 ? nominal - *v[1] : *v[1]));
    output.down.push_back(sign * factor * (options.file_type == 0 ? nominal - *v[2] : *v[2]));
  }
  if (map.nodes[0].size() < 2) diagnostics.error(file, {}, "fewer than two triplets");
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  if (const auto other = other_type(map.nodes[0], output.up, options.file_type))
    return fail(ErrorCode::wrong_input, *other, file);
  if (output.down == output.up) output.down.clear();
  map.outputs = {output};
  return ControlTables{.errors = {}, .location = {}, .corrections = {map}};
}

Result<std::string> write_linuxcnc(const ControlTables& tables, const Machine& machine,
                                   const FormatOptions& options) {
  if (tables.corrections.size() != 1 || tables.corrections[0].inputs.size() != 1 ||
      tables.corrections[0].outputs.size() != 1 ||
      tables.corrections[0].outputs[0].axis != tables.corrections[0].inputs[0])
    return refuse("this format holds the corrections of one axis over its own position");
  const CorrectionMap& map = tables.corrections[0];
  if (map.nodes[0].size() > kMostEntries)
    return refuse(std::to_string(map.nodes[0].size()) + " nodes; the control takes " +
                  std::to_string(kMostEntries));
  const auto& output = map.outputs[0];
  const double factor = position_factor(machine.axes[*machine.axis(map.inputs[0])]),
               sign = options.negate ? -1.0 : 1.0;
  std::string out;
  for (std::size_t i = 0; i < map.nodes[0].size(); ++i) {
    const double nominal = map.nodes[0][i] / factor;
    const auto entry = [&](double correction) {
      return plain(options.file_type == 0 ? nominal - sign * correction / factor
                                          : sign * correction / factor);
    };
    out += plain(nominal) + " " + entry(output.up[i]) + " " +
           entry(output.down.empty() ? output.up[i] : output.down[i]) + "\n";
  }
  return out;
}

}  // namespace

TableFormat linuxcnc_format() {
  return {
      "linuxcnc",
      "LinuxCNC COMP_FILE: one axis' screw, type 0 (actual positions) or 1 (trims)",
      true,
      read_linuxcnc,
      write_linuxcnc,
      "LinuxCNC does not apply [JOINT_n] BACKLASH any more once a COMP_FILE is loaded, and this one is the "
      "same in both directions: lost motion that was corrected so comes back"};
}

}  // namespace trunnion::formats
