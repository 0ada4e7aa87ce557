// Aerotech's `.dat` of two axes. No description is published; these are the files of public repositories and
// the programs there that read and write them. The sign is that of a file beside the table made from it:
// corrections are the first error less each.
#include <algorithm>
#include <array>
#include <map>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/printable.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/import.hpp"

#include "diagnosis/data/foreign_lines.hpp"

namespace trunnion::diagnosis {
namespace {

struct StageFile {
  std::array<std::string, 2> axes;  // as the file names them
  std::array<std::size_t, 2> position{}, measured{};
  bool absolute = false;  // the measured position, not its error
  double unit_mm = 1.0;
  std::vector<ForeignLine> points;
  std::uint32_t header_line = 1;
};

using Columns = std::vector<std::string_view>;

std::optional<std::size_t> column(const Columns& names, std::string_view name) {
  const auto it = std::find(names.begin(), names.end(), name);
  return it == names.end() ? std::nullopt : std::optional(static_cast<std::size_t>(it - names.begin()));
}

bool take_columns(const Columns& names, const std::array<std::string_view, 4>& wanted, StageFile& out) {
  for (std::size_t k = 0; k < 2; ++k) {
    const auto position = column(names, wanted[2 * k]), measured = column(names, wanted[2 * k + 1]);
    if (!position || !measured) return false;
    out.position[k] = *position;
    out.measured[k] = *measured;
  }
  return true;
}

// `key : value` of a line, or of its parts between semicolons.
std::map<std::string, std::string> pairs_of(std::string_view text) {
  std::map<std::string, std::string> out;
  while (!text.empty()) {
    const auto end = std::min(text.find(';'), text.size());
    const std::string_view part = text.substr(0, end);
    if (const auto colon = part.find(':'); colon != std::string_view::npos)
      out[std::string(trimmed(part.substr(0, colon)))] = trimmed(part.substr(colon + 1));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

// `%Ax1Name: Y; Ax1Num: 1; Ax1Sign: 1; Ax1Slave: 0`
void percent_line(const ForeignLine& line, const std::string& file, StageFile& out,
                  Diagnostics& diagnostics) {
  const std::string_view text = line.text.substr(1);
  if (const Columns names = words_of(text);
      take_columns(names, {"Ax1CmdPos", "Ax1RelErr", "Ax2CmdPos", "Ax2RelErr"}, out))
    out.header_line = line.number;
  const auto pairs = pairs_of(text);
  const auto value = [&](const std::string& key) {
    const auto it = pairs.find(key);
    return it == pairs.end() ? std::string() : it->second;
  };
  for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
    const std::string axis = "Ax" + std::to_string(k + 1);
    if (const std::string name = value(axis + "Name"); !name.empty()) out.axes[k] = name;
    if (const std::string sign = value(axis + "Sign"); !sign.empty() && sign != "1")
      diagnostics.error(file, {line.number, 1},
                        axis + "Sign is '" + printable(sign) +
                            "': only files with 1 are read, the sense of others is not known");
  }
  if (const std::string unit = value("UserUnits"); !unit.empty()) {
    if (unit == "MM" || unit == "METRIC")
      out.unit_mm = 1.0;
    else if (unit == "UM")
      out.unit_mm = kMmPerUm;
    else if (unit == "ENGLISH")
      out.unit_mm = kMmPerInch;
    else
      diagnostics.error(file, {line.number, 1},
                        "UserUnits '" + printable(unit) + "' is none of MM, METRIC, UM, ENGLISH");
  }
}

// `MotionDirection : 1 ; 1`
void header_line(const ForeignLine& line, const std::string& file, Diagnostics& diagnostics) {
  const auto colon = line.text.find(':');
  if (colon == std::string_view::npos) return;
  const std::string_view key = trimmed(line.text.substr(0, colon));
  if (key != "MotionDirection" && key != "ConversionFactor") return;
  std::string_view values = line.text.substr(colon + 1);
  while (!values.empty()) {
    const auto end = std::min(values.find(';'), values.size());
    if (const std::string_view value = trimmed(values.substr(0, end)); value != "1")
      diagnostics.error(
          file, {line.number, 1},
          std::string(key) + " is '" + printable(std::string(value)) + "': only files with 1 are read");
    values.remove_prefix(std::min(end + 1, values.size()));
  }
}

Result<StageFile> parsed(std::string_view text, const std::string& file, Diagnostics& diagnostics) {
  StageFile out;
  const auto lines = lines_of(text);
  const auto start =
      std::find_if(lines.begin(), lines.end(), [](const ForeignLine& l) { return l.text == ":START"; });
  const std::size_t before = diagnostics.error_count();
  bool known = false;
  if (start != lines.end()) {
    for (auto line = lines.begin(); line != start; ++line) header_line(*line, file, diagnostics);
    if (start != lines.begin()) {
      known = take_columns(words_of((start - 1)->text),
                           {"Position1", "LaserData1", "Position2", "LaserData2"}, out);
      out.header_line = (start - 1)->number;
    }
    out.absolute = true;
    out.points.assign(start + 1, lines.end());
  } else {
    for (const ForeignLine& line : lines) {
      if (line.text.starts_with('%'))
        percent_line(line, file, out, diagnostics);
      else
        out.points.push_back(line);
    }
    known = out.measured[0] != out.measured[1];
  }
  if (!known)
    return fail(ErrorCode::wrong_input,
                "no columns Position1, LaserData1, Position2, LaserData2 before :START, and none Ax1CmdPos, "
                "Ax1RelErr, "
                "Ax2CmdPos, Ax2RelErr in a line of %",
                file, {out.header_line, 1});
  std::erase_if(out.points, [](const ForeignLine& l) { return l.text.empty() || l.text == ":END"; });
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  return out;
}

}  // namespace

Result<std::string> import_stage(std::string_view text, const std::string& file, const Machine& machine,
                                 const StageImport& options, Diagnostics& diagnostics) {
  const auto stage = parsed(text, file, diagnostics);
  if (!stage) return tl::unexpected(stage.error());
  std::array<AxisId, 2> axes{};
  for (std::size_t k = 0; k < 2; ++k) {
    const std::string name = options.axes.size() == 2 ? options.axes[k] : stage->axes[k];
    const auto axis = machine.axis(name);
    if (!axis || machine.axes[*axis].kind != AxisKind::linear)
      return fail(
          ErrorCode::wrong_input,
          (name.empty() ? "the file does not name its axes"
                        : "'" + printable(name) + "' is no linear axis of machine '" + machine.name + "'") +
              ": say with --axes which are its first and second, as in --axes X,Y",
          file, {stage->header_line, 1});
    axes[k] = *axis;
  }
  const std::size_t before = diagnostics.error_count();
  DealtReadings out(machine, options.parts);
  for (const ForeignLine& line : stage->points) {
    const auto numbers = numbers_of(line, file, diagnostics);
    const std::size_t needed =
        std::max({stage->position[0], stage->position[1], stage->measured[0], stage->measured[1]}) + 1;
    if (numbers.size() < needed) {
      diagnostics.error(
          file, {line.number, 1},
          std::to_string(numbers.size()) + " numbers where " + std::to_string(needed) + " are expected");
      continue;
    }
    JointVector q;
    for (std::size_t k = 0; k < 2; ++k) q[axes[k]] = numbers[stage->position[k]] * stage->unit_mm;
    out.at(q);
    for (std::size_t k = 0; k < 2; ++k) {
      const Axis& axis = machine.axes[axes[k]];
      const double measured = numbers[stage->measured[k]] * stage->unit_mm;
      // The tool relative to the part goes the other way when the axis carries the part.
      const Vec3 n = axis.carries_part ? Vec3(-axis.direction) : axis.direction;
      out.add(Quantity::displacement, n, stage->absolute ? measured - q[axes[k]] : measured,
              options.u_random_um * kMmPerUm);
    }
  }
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  if (out.points() == 0)
    return fail(ErrorCode::wrong_input, "no line with a position", file, {stage->header_line, 1});
  return out.text(
      {"two axes of a stage, " + file + ", u_random " + shortest_text(options.u_random_um) + " um assumed"});
}

}  // namespace trunnion::diagnosis
