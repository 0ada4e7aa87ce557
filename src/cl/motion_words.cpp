#include <algorithm>
#include <string>

#include "trunnion/base/units.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

// A GOTO without an axis in a tilted CSYS could mean the last axis or that of the CSYS.
constexpr double kSameAxis = 1e-3;

bool three_or_six(Context& context, const Statement& statement) {
  const std::size_t count = statement.fields.size();
  if (count == 3 || count == 6) return true;
  context.error(statement.where, std::string(statement.word) + ": " + std::to_string(count) +
                                     (count == 1 ? " value" : " values") +
                                     "; 3 (x, y, z) or 6 (x, y, z, i, j, k) are needed");
  return false;
}

/// The tool axis of a statement of 3 or 6 values: its own, else the modal one.
std::optional<Vec3> axis_of(Context& context, const Statement& statement) {
  if (statement.fields.size() == 6) return context.axis(statement, 3);
  if (context.modal.axis_unsure) {
    context.error(statement.where,
                  std::string(statement.word) +
                      " without a tool axis behind MULTAX/OFF: that before it (CATIA), or +Z (Fusion)?");
    return std::nullopt;
  }
  const auto& tilted = context.modal.tilted_csys_axis;
  if (tilted && (*tilted - context.modal.axis_A).norm() > kSameAxis) {
    context.error(statement.where,
                  std::string(statement.word) +
                      " without a tool axis under a tilted CSYS: the last axis or that of the CSYS?");
    return std::nullopt;
  }
  return context.modal.axis_A;
}

void read_goto(Context& context, const Statement& statement) {
  if (!three_or_six(context, statement)) return;
  const auto tip_A = context.point(statement, 0);
  const auto axis_A = axis_of(context, statement);
  if (!tip_A || !axis_A) return;
  if (context.modal.pending_arc) {
    finish_arc(context, statement.where, *tip_A, *axis_A);
  } else if (context.modal.cycle) {
    drill_hole(context, statement.where, *tip_A, *axis_A);
  } else {
    context.move_to(statement.where, *tip_A, *axis_A);
  }
}

void read_godlta(Context& context, const Statement& statement) {
  if (!three_or_six(context, statement)) return;
  const auto step_A = context.point(statement, 0);
  const auto axis_A = axis_of(context, statement);
  if (!context.modal.has_position) {
    context.error(statement.where, "GODLTA before any position: there is nothing to go on from");
    return;
  }
  if (context.modal.pending_arc || context.modal.cycle) {
    context.error(statement.where, "GODLTA behind CIRCLE or under CYCLE: a GOTO is needed");
    return;
  }
  if (!step_A || !axis_A) return;
  const Vec3 tip_A = context.modal.tip_A + *step_A;
  if (!(tip_A.cwiseAbs().maxCoeff() <= Context::kLongest_mm)) {
    context.error(statement.where, "GODLTA leads beyond " + short_text(Context::kLongest_mm) + " mm");
    return;
  }
  context.move_to(statement.where, tip_A, *axis_A);
}

void read_from(Context& context, const Statement& statement) {
  if (!three_or_six(context, statement)) return;
  const auto tip_A = context.point(statement, 0);
  const auto axis_A = axis_of(context, statement);
  if (tip_A && axis_A) context.start_from(statement.where, *tip_A, *axis_A);
}

// A rapid to the point, or to that of FROM.
void read_gohome(Context& context, const Statement& statement) {
  if (context.modal.pending_arc || context.modal.cycle) {
    context.error(statement.where, "GOHOME behind CIRCLE or under CYCLE: a GOTO is needed");
    return;
  }
  if (!statement.has_fields()) return context.go_home(statement.where);
  if (!three_or_six(context, statement)) return;
  const auto tip_A = context.point(statement, 0);
  const auto axis_A = axis_of(context, statement);
  if (!tip_A || !axis_A) return;
  context.modal.rapid_next = true;
  context.move_to(statement.where, *tip_A, *axis_A);
}

// OFF, as some systems end with it what ON began, must not make a rapid of the next cut.
void read_rapid(Context& context, const Statement& statement) {
  const auto is_off = [](const Field& field) { return field.text == "OFF"; };
  if (std::any_of(statement.fields.begin(), statement.fields.end(), is_off)) {
    context.modal.rapid_next = false;
    return;
  }
  for (const Field& field : statement.fields) {
    if (field.text.empty()) continue;
    if (field.text == "ON") {
      context.warning_once("RAPID/ON", field.where,
                           "RAPID/ON: the next motion is a rapid, those behind it go at the feed");
      continue;
    }
    context.warning_once("RAPID/" + std::string(field.text), field.where,
                         "RAPID/" + std::string(field.text) + ": taken as RAPID");
  }
  context.modal.rapid_next = true;
}

// Whether an axis is given is seen from the points. What holds where none is, behind MULTAX/OFF, systems
// differ in: CATIA locks the last one, Fusion writes OFF for operations along +Z.
void take_multax_off(Context& context) {
  Modal& modal = context.modal;
  if (modal.axis_A == Vec3::UnitZ() || modal.origin.catia) return;
  if (modal.origin.fusion) {
    modal.axis_A = Vec3::UnitZ();
  } else {
    modal.axis_unsure = true;
  }
}

void read_multax(Context& context, const Statement& statement) {
  if (statement.fields.size() > 1 ||
      (statement.has_fields() && statement.fields[0].text != "ON" && statement.fields[0].text != "OFF" &&
       !statement.fields[0].text.empty())) {
    context.error(statement.where,
                  statement.fields.size() > 1
                      ? "MULTAX: a second value, " + std::string(statement.fields[1].text.substr(0, 40))
                      : "MULTAX/" + std::string(statement.fields[0].text) + ": ON or OFF is needed");
  } else if (statement.has_fields() && statement.fields[0].text == "OFF") {
    take_multax_off(context);
  } else {
    context.modal.origin.mill = true;
  }
}

void read_tlaxis(Context& context, const Statement& statement) {
  if (statement.fields.size() != 3) {
    context.error(statement.where,
                  "TLAXIS: " + std::to_string(statement.fields.size()) + " values; 3 (i, j, k) are needed");
    return;
  }
  const auto axis_A = context.axis(statement, 0);
  if (axis_A) context.modal.axis_A = *axis_A;
}

void read_units(Context& context, const Statement& statement) {
  if (statement.fields.size() > 1)
    return context.error(statement.fields[1].where, std::string(statement.word) + ": a second value, " +
                                                        std::string(statement.fields[1].text.substr(0, 40)) +
                                                        "; MM or INCHES is needed");
  const std::string_view unit = statement.fields.size() == 1 ? statement.fields[0].text : std::string_view{};
  double factor = 0.0;
  if (unit == "MM") {
    factor = 1.0;
  } else if (unit == "INCHES" || unit == "INCH" || unit == "IN") {
    factor = kMmPerInch;
  } else {
    const SourceRef where = statement.has_fields() ? statement.fields[0].where : statement.where;
    context.error(where, std::string(statement.word) + ": '" + std::string(unit.substr(0, 40)) +
                             "' is no unit; MM or INCHES is needed");
    return;
  }
  Modal& modal = context.modal;
  if (factor != modal.mm_per_unit && !modal.units.word && modal.units.first_use) {
    return context.error(statement.where, "UNITS/" + std::string(unit) + " behind lengths (line " +
                                              std::to_string(modal.units.first_use->line) +
                                              ") whose unit nothing says: move it before them");
  }
  if (modal.has_position && factor != modal.mm_per_unit) {
    context.warning(statement.where, "the unit changes after the first position");
  }
  const auto& given = context.options().units;
  if (given && context.options().units_are_asked_for &&
      (*given == ReaderOptions::Units::inch) != (factor == kMmPerInch))
    context.warning_once("--cl-units", statement.where,
                         std::string(statement.word) + "/" + std::string(unit) +
                             " holds: --cl-units, which says the other one, is for files without this word");
  modal.units.word = true;
  modal.mm_per_unit = factor;
}

constexpr WordReading kMotionWords[] = {
    {"GOTO", read_goto},     {"GODLTA", read_godlta}, {"FROM", read_from},
    {"GOHOME", read_gohome}, {"RAPID", read_rapid},   {"MULTAX", read_multax},
    {"TLAXIS", read_tlaxis}, {"UNITS", read_units},   {"UNIT", read_units}};

}  // namespace

std::span<const WordReading> motion_words() {
  return kMotionWords;
}

}  // namespace trunnion::cl
