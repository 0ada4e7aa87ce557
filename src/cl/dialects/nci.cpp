// Mastercam NCI: two lines a record, a code and its values, blanks between them. Lengths and feeds have no
// unit in the file: they are in ReaderOptions::units. Layout as the milling records of version 9 and later:
//   0, 1        compensation, x, y, z, feed                         straight; in the tool plane
//   2, 3        plane, compensation, x, y of the end, x, y of the center, z, feed   clockwise,
//   counterclockwise 4           seconds 11          x, y, z of the tip, x, y, z of a second point of the
//   tool axis towards the spindle, feed 1000 - 1002 -, -, -, tool, diameter offset, length offset, -, spindle
//   speed (< 0 counterclockwise), -, coolant 1013        compensation, diameter, corner radius 1014, 1027
//   tool plane (9), working coordinate system (9 and 3)
//   1018, 1019  begin and end of a subprogram ("MP Post Reference Guide" of version 9.1, chapter 6): refused
// Feed -1: unchanged, -2: rapid.
#include "cl/nci.hpp"

#include <array>
#include <cmath>
#include <string>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

constexpr double kIdentity = 1e-6;
constexpr double kShortestAxis_mm = 1e-3;

bool is_identity(const std::array<double, 12>& m) {
  constexpr std::array<double, 12> kUnit = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  for (std::size_t i = 0; i < m.size(); ++i) {
    if (std::abs(m[i] - kUnit[i]) > kIdentity) return false;
  }
  return true;
}

/// The fields of a line of values.
void split_values(std::string_view line, std::uint32_t number, Statement& statement) {
  std::size_t at = 0;
  while ((at = line.find_first_not_of(" \t,", at)) != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(" \t,", at), line.size());
    statement.fields.push_back(
        {line.substr(at, end - at), {number, static_cast<std::uint32_t>(at + 1)}, false});
    at = end;
  }
}

}  // namespace

bool NciReader::next(Context& context, Scanner& scanner) {
  std::string_view line;
  Statement code_line;
  do {
    if (!scanner.line(line)) return false;
    if (line.find_first_not_of(" \t") == std::string_view::npos) continue;
    split_values(line, scanner.line_number(), code_line);
    if (!code_line.fields.empty()) break;
    context.give_up({scanner.line_number(), 1}, "NCI: a line with one code is needed");
    return false;
  } while (true);
  const auto code = parse_integer(code_line.fields[0].text);
  const SourceRef where = code_line.fields[0].where;
  if (context.modal.ended) {
    context.give_up(where, "NCI: what stands behind the end (1003) would be left out: a second file?");
    return false;
  }
  if (!code || code_line.fields.size() != 1) {
    context.give_up(where, "NCI: a line with one code is needed");
    return false;
  }
  context.modal.closing = "1003";
  const std::string word = "NCI " + std::to_string(*code);
  if (!scanner.line(line)) {
    if (*code != 1003) context.error(where, word + ": its line of values is missing");
    if (*code == 1003) context.emit(where, End{});
    return false;
  }
  Statement statement;
  statement.word = word;
  statement.where = where;
  statement.text = line;
  split_values(line, scanner.line_number(), statement);
  read(context, *code, statement);
  return true;
}

void NciReader::read(Context& context, std::uint64_t code, const Statement& statement) {
  if (code <= 3 || code == 11) return read_motion(context, code, statement);
  if (code == 4) {
    const auto seconds = context.number(statement, 0);
    if (seconds && *seconds > 0.0) context.emit(statement.where, Dwell{*seconds, std::nullopt});
  } else if (code >= 1000 && code <= 1002) {
    read_tool(context, code, statement);
  } else if (code == 1003) {
    context.modal.ended = true;
    context.emit(statement.where, End{});
  } else if (code >= 1005 && code <= 1008) {
    context.emit(statement.where,
                 Text{code == 1006 ? Text::Kind::insert : Text::Kind::print, shown_text(statement.text)});
  } else if (code == 1013) {
    double value[3];
    if (!context.numbers(statement, 0, 3, value)) return;
    const double mm = context.modal.mm_per_unit;
    context.emit(statement.where, ToolGeometry{value[1] * mm, value[2] * mm, std::nullopt});
  } else if (code == 1014 || code == 1027) {
    std::array<double, 12> matrix{};
    if (!context.numbers(statement, 0, code == 1014 ? 9 : 12, matrix.data())) return;
    (code == 1014 ? plane_turned_ : system_turned_) = !is_identity(matrix);
  } else if ((code < 1000 && code != 80) || code == 1018 || code == 1019) {
    // 1018, 1019: a subprogram, whose motions may run again elsewhere.
    context.error(statement.where, std::string(statement.word) +
                                       " changes the geometry and is not understood by this program");
  }
}

// True when a motion of this kind may be read at all.
bool NciReader::allowed(Context& context, const Statement& statement, std::size_t compensation_at,
                        bool in_plane) const {
  const std::string word(statement.word);
  if (system_turned_ || (in_plane && plane_turned_)) {
    context.error(statement.where,
                  word + " in a turned plane (1014, 1027) is not understood by this program");
    return false;
  }
  if (!in_plane) return true;
  const auto compensation = context.number(statement, compensation_at);
  if (!compensation) return false;
  const bool off = *compensation == 0.0 || *compensation == 40.0 || *compensation == 140.0;
  if (!off && context.options().cutter_compensation != ReaderOptions::CutterCompensation::tool_center) {
    context.error(statement.where,
                  word + ": cutter compensation changes the geometry and is not understood by this program");
    return false;
  }
  return true;
}

bool NciReader::take_feed(Context& context, const Statement& statement, std::size_t at) {
  const auto value = context.number(statement, at);
  if (!value) return false;
  if (*value == -2.0) {
    context.modal.rapid_next = true;
  } else if (*value > 0.0) {
    context.modal.feed = {FeedMode::per_minute, *value * context.modal.mm_per_unit / kSecondsPerMinute};
  } else if (*value != -1.0) {
    context.error(statement.fields[at].where, std::string(statement.word) + ": feed " +
                                                  shortest_text(*value) +
                                                  "; above 0, -1 (unchanged) or -2 (rapid) is needed");
    return false;
  }
  return true;
}

void NciReader::read_motion(Context& context, std::uint64_t code, const Statement& statement) {
  if (code == 11) return read_five_axis(context, statement);
  if (code >= 2) return read_arc(context, code == 2, statement);
  if (!allowed(context, statement, 0, true)) return;
  const auto tip = context.point(statement, 1);
  if (!tip || !take_feed(context, statement, 4)) return;
  if (code == 0) context.modal.rapid_next = true;
  context.move_to(statement.where, *tip, Vec3::UnitZ());
}

void NciReader::read_five_axis(Context& context, const Statement& statement) const {
  if (!allowed(context, statement, 0, false)) return;
  const auto tip = context.point(statement, 0);
  const auto second = context.point(statement, 3);
  if (!tip || !second || !take_feed(context, statement, 6)) return;
  const Vec3 along = *second - *tip;
  const double length = along.norm();
  if (!(length > kShortestAxis_mm)) {
    return context.error(statement.where, "NCI 11: the tip and the second point are " + short_text(length) +
                                              " mm apart: the tool axis has no direction");
  }
  // The points' rounding, seen from the tip: the farther the second one, the finer the axis.
  const double places =
      decimals_of(statement.fields[3].text) + std::log10(length / context.modal.mm_per_unit);
  context.count_decimals(0, static_cast<unsigned>(std::max(0.0, std::floor(places))));
  context.move_to(statement.where, *tip, along / length);
}

void NciReader::read_arc(Context& context, bool clockwise, const Statement& statement) const {
  if (!allowed(context, statement, 1, true)) return;
  double value[8];
  if (!context.numbers(statement, 0, 8, value)) return;
  if (value[0] != 0.0) {
    return context.error(statement.where, std::string(statement.word) + ": an arc in plane " +
                                              short_text(value[0]) + " is not understood by this program");
  }
  if (!context.modal.has_position)
    return context.error(statement.where, std::string(statement.word) + " before any position");
  if (!take_feed(context, statement, 7)) return;
  const double mm = context.modal.mm_per_unit;
  for (std::size_t i = 2; i <= 6; ++i) {
    if (!(std::abs(value[i] * mm) <= Context::kLongest_mm)) {
      return context.error(statement.fields[i].where, std::string(statement.word) + ": " +
                                                          short_text(value[i] * mm) + " mm is beyond " +
                                                          short_text(Context::kLongest_mm) + " mm");
    }
  }
  PendingArc arc;
  arc.where = statement.where;
  arc.center_A = Vec3(value[4], value[5], value[6]) * mm;
  arc.normal_A = clockwise ? Vec3(-Vec3::UnitZ()) : Vec3(Vec3::UnitZ());
  arc.full_when_closed = true;
  context.modal.pending_arc = arc;
  finish_arc(context, statement.where, Vec3(value[2], value[3], value[6]) * mm, Vec3::UnitZ());
}

void NciReader::read_tool(Context& context, std::uint64_t code, const Statement& statement) {
  const auto tool = context.whole(statement, 3);
  const auto length_register = context.whole(statement, 5);
  const auto speed = context.number(statement, 7);
  if (!tool || !length_register || !speed) return;
  auto& said = context.modal.said;
  if (code == 1000 && said.tool != 0 && (*tool != said.tool || *length_register != said.length_register)) {
    return context.error(statement.where, "1000 keeps the tool, which is " + std::to_string(said.tool) +
                                              " with length register " +
                                              std::to_string(said.length_register) + ", and names tool " +
                                              std::to_string(*tool) + " with register " +
                                              std::to_string(*length_register));
  }
  said.tool = *tool;
  said.length_register = *length_register;
  if (code != 1000)
    context.emit(statement.where, ToolChange{*tool, *length_register});  // 1000: the tool stays
  constexpr std::size_t kCoolant = 9;
  if (statement.fields.size() > kCoolant) {
    const auto coolant = context.number(statement, kCoolant);
    if (!coolant) return;
    // What its values mean differs between versions.
    if (*coolant != 0.0) {
      context.warning_once("NCI coolant", statement.fields[kCoolant].where,
                           "the coolant " + shortest_text(*coolant) +
                               " of this tool is not acted on: the program switches none on");
    }
  }
  Spindle spindle;
  spindle.state = *speed == 0.0 ? Spindle::State::off : Spindle::State::on;
  if (*speed != 0.0) spindle.speed_rpm = std::abs(*speed);
  spindle.counterclockwise = *speed < 0.0;
  context.emit(statement.where, spindle);
}

}  // namespace trunnion::cl
