#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

constexpr double kFastest_mm_s = 1e5;  // 6000 m/min: no machine; beyond it, a fault of the file

bool starts_number(std::string_view text) {
  return !text.empty() && std::string_view("0123456789+-.").find(text.front()) != std::string_view::npos;
}

struct FeedUnit {
  std::string_view word;
  FeedMode mode;
  double factor;  // to mm/s, mm/rev, 1/s; 0: the file's unit of length
};
constexpr FeedUnit kFeedUnits[] = {
    {"MMPM", FeedMode::per_minute, 1.0 / kSecondsPerMinute},
    {"IPM", FeedMode::per_minute, kMmPerInch / kSecondsPerMinute},
    {"FPM", FeedMode::per_minute, kMmPerFoot / kSecondsPerMinute},
    {"PERMIN", FeedMode::per_minute, 0.0},
    {"MMPR", FeedMode::per_revolution, 1.0},
    {"IPR", FeedMode::per_revolution, kMmPerInch},
    {"FPR", FeedMode::per_revolution, kMmPerFoot},
    {"PERREV", FeedMode::per_revolution, 0.0},
    {"INVERS", FeedMode::inverse, 1.0 / kSecondsPerMinute},
    {"INVERSE", FeedMode::inverse, 1.0 / kSecondsPerMinute},
};

}  // namespace

std::optional<std::pair<FeedMode, double>> feed_unit_factor(std::string_view word, double mm_per_unit) {
  for (const FeedUnit& unit : kFeedUnits) {
    if (unit.word != word) continue;
    if (unit.factor != 0.0) return std::pair(unit.mode, unit.factor);
    return std::pair(unit.mode,
                     unit.mode == FeedMode::per_minute ? mm_per_unit / kSecondsPerMinute : mm_per_unit);
  }
  return std::nullopt;
}

namespace {

// Words that the post acts on; their fields go there as they stand.
void read_post_word(Context& context, const Statement& statement) {
  PostWord word{std::string(statement.word), {}};
  for (const Field& field : statement.fields) word.fields.emplace_back(field.text);
  context.emit(statement.where, std::move(word));
}

// Lengths among the fields in mm: the post knows nothing of the file's unit.
void read_post_lengths(Context& context, const Statement& statement) {
  PostWord word{std::string(statement.word), {}};
  const bool clears = statement.word == "CLEARP";
  bool rotary = false;
  std::size_t numbers = 0;
  for (const Field& field : statement.fields) {
    const auto number = parse_number(field.text);
    if (!number) {
      rotary = field.text == "AAXIS" || field.text == "BAXIS" || field.text == "CAXIS";
      word.fields.emplace_back(field.text);
      continue;
    }
    ++numbers;
    // The first three of CLEARP/a,b,c,d are a direction.
    const bool length = clears ? statement.fields.size() == 2 || numbers == 4 : !rotary;
    word.fields.push_back(shortest_text(number.value * (length ? context.modal.mm_per_unit : 1.0)));
  }
  if (clears) word = context.take_clear_plane(std::move(word));
  context.emit(statement.where, std::move(word));
}

// ROTATE turns a rotary axis (PostWorks), or geometry (other systems).
void read_rotate(Context& context, const Statement& statement) {
  const std::string_view first = statement.has_fields() ? statement.fields[0].text : std::string_view{};
  if (first == "TABLE" || first == "AXIS" || (first.size() == 5 && first.substr(1) == "AXIS"))
    return read_post_word(context, statement);
  context.error(statement.where, "ROTATE changes the geometry and is not understood by this program");
}

// RETRCT: rapid along the tool axis to the clearance plane.
void read_retrct(Context& context, const Statement& statement) {
  if (statement.has_fields() && !statement.fields[0].text.empty()) {
    return context.error(statement.where, "RETRCT/" + std::string(statement.fields[0].text.substr(0, 40)) +
                                              " changes the geometry and is not understood by this program");
  }
  context.retract(statement.where);
}

// FEDRAT/v  FEDRAT/v,unit  FEDRAT/unit,v. Without a unit: of the kind before, in the file's unit of length.
void read_fedrat(Context& context, const Statement& statement) {
  std::optional<std::size_t> value_at;
  std::optional<std::pair<FeedMode, double>> unit;
  for (std::size_t i = 0; i < statement.fields.size(); ++i) {
    const Field& field = statement.fields[i];
    if (starts_number(field.text) || field.text.empty()) {
      if (value_at) return context.error(field.where, "FEDRAT: a second value");
      value_at = i;
      continue;
    }
    if (field.text == "AUTO" ||
        field.text == "OFF") {  // FEDRAT/INVERS,AUTO: how the post is to write feeds, no feed
      return read_post_word(context, statement);
    }
    if (unit) return context.error(field.where, "FEDRAT: a second unit");
    unit = feed_unit_factor(field.text, context.modal.mm_per_unit);
    context.take_feed_unit(field.text, field.where);
    if (!unit) {
      return context.error(
          field.where,
          "FEDRAT: '" + std::string(field.text.substr(0, 40)) +
              "' is no unit of feed; MMPM, IPM, FPM, PERMIN, MMPR, IPR, FPR, PERREV or INVERS is needed");
    }
  }
  if (!value_at) return context.error(statement.where, "FEDRAT: no value");
  const auto value = context.positive(statement, *value_at);
  if (!value) return;
  if (!unit) {
    // The kind of feed stays (NCCS PostWorks, fedrat.f): in which unit it counts UNITS says.
    const FeedMode mode = context.modal.feed.value > 0.0 ? context.modal.feed.mode : FeedMode::per_minute;
    const std::string_view word = mode == FeedMode::per_revolution ? "PERREV"
                                  : mode == FeedMode::inverse      ? "INVERS"
                                                                   : "PERMIN";
    unit = feed_unit_factor(word, context.modal.mm_per_unit);
    context.take_feed_unit(word, statement.where);
    constexpr double kMostOfTurn_mm = 10.0;  // what a turn of a mill takes is below 5
    if (mode == FeedMode::per_revolution && *value * unit->second > kMostOfTurn_mm)
      return context.error(statement.fields[*value_at].where,
                           "FEDRAT without a unit, and the feed before it was per revolution: " +
                               short_text(*value) + " in a turn is no feed; say the unit");
    if (mode != FeedMode::per_minute) {
      context.warning_once("FEDRAT " + std::string(word), statement.where,
                           "FEDRAT without a unit: taken as the feed before it, " +
                               std::string(mode == FeedMode::inverse ? "inverse time" : "per revolution"));
    }
  }
  const Feed feed{unit->first, *value * unit->second};
  if (feed.mode != FeedMode::inverse && feed.value > kFastest_mm_s) {
    return context.error(
        statement.fields[*value_at].where,
        "FEDRAT: " + short_text(feed.value) + " mm/s is beyond " + short_text(kFastest_mm_s) + " mm/s");
  }
  context.modal.feed = feed;
}

// Value, unit and way in any order: SPINDL/RPM,800,CLW  SPINDL/500,SFM,CCLW  SPINDL/ON  SPINDL/OFF.
// What one word of SPINDL says.
enum class SpindleWord : std::uint8_t { on, clockwise, counterclockwise, off };

std::optional<SpindleWord> spindle_word(std::string_view text) {
  static constexpr std::pair<std::string_view, SpindleWord> kWords[] = {
      {"CLW", SpindleWord::clockwise},
      {"CW", SpindleWord::clockwise},
      {"CCLW", SpindleWord::counterclockwise},
      {"CCW", SpindleWord::counterclockwise},
      {"OFF", SpindleWord::off},
      {"LOCK", SpindleWord::off},
      {"NEUTRL", SpindleWord::off},
      {"STOP", SpindleWord::off},
      {"ON", SpindleWord::on},
  };
  for (const auto& [word, meaning] : kWords) {
    if (word == text) return meaning;
  }
  return std::nullopt;
}

// Where SPINDL/5000 says no sense the one that was said last holds (so APT has it). It was said for another
// tool where one was loaded since: to turn that one to the left by itself may be wrong, and so may be not to.
bool take_sense(Context& context, const Statement& statement, std::optional<bool> counterclockwise,
                Spindle& spindle) {
  auto& last = context.modal.said;
  if (counterclockwise) {
    last.counterclockwise = *counterclockwise;
    last.of_tool = last.tool;
  } else if (last.counterclockwise && last.of_tool != last.tool && spindle.state == Spindle::State::on) {
    context.error(statement.where,
                  "SPINDL says neither CLW nor CCLW, and the tool before turned counterclockwise: say which "
                  "way this one turns");
    return false;
  }
  spindle.counterclockwise = last.counterclockwise;
  return true;
}

void read_spindl(Context& context, const Statement& statement) {
  // hyperMILL names the spindle that works: a mill has one.
  if (statement.fields.size() == 1 && statement.fields[0].text == "MAIN") return;
  Spindle spindle;
  double surface_factor = 0.0;
  std::optional<double> value;
  std::optional<bool> counterclockwise;
  std::string_view unit;
  bool is_on = false;
  const Field* unknown = nullptr;
  bool says = statement.fields.empty();
  const auto second = [&](const Field& field) {
    context.error(field.where, "SPINDL: " + std::string(field.text) + " contradicts what stands before it");
  };
  for (std::size_t i = 0; i < statement.fields.size(); ++i) {
    const Field& field = statement.fields[i];
    const std::string_view text = field.text;
    if (text.empty()) continue;
    if (starts_number(text)) {
      const auto number = context.number(statement, i);
      if (!number) return;
      if (*number < 0.0) {
        return context.error(field.where, "SPINDL: " + shortest_text(*number) + " is below 0");
      }
      // SPINDL/3,000 is one speed with a comma in it, and no speed of 3.
      if (value) return context.error(field.where, "SPINDL: a second value");
      value = number;
    } else if (text == "MAXRPM" || text == "LIMIT") {
      spindle.max_rpm = context.positive(statement, ++i);
      if (!spindle.max_rpm) return;
    } else if (text == "SFM" || text == "SMM" || text == "RPM") {
      if (!unit.empty() && unit != text) return second(field);
      unit = text;
      if (text == "SFM") surface_factor = kMmPerFoot / kSecondsPerMinute;
      if (text == "SMM") surface_factor = 1000.0 / kSecondsPerMinute;  // m/min
    } else if (text == "ORIENT") {
      spindle.state = Spindle::State::orient;
    } else if (const auto word = spindle_word(text)) {
      const bool stands = *word == SpindleWord::off;
      const bool left = *word == SpindleWord::counterclockwise;
      if (stands ? is_on : spindle.state == Spindle::State::off) return second(field);
      if (!stands && *word != SpindleWord::on && counterclockwise.value_or(left) != left)
        return second(field);
      if (stands) spindle.state = Spindle::State::off;
      if (!stands) is_on = true;
      if (!stands && *word != SpindleWord::on) counterclockwise = left;
    } else {
      // A number behind it is its own (RANGE,2).
      const bool has_number = i + 1 < statement.fields.size() && starts_number(statement.fields[i + 1].text);
      if (has_number) ++i;
      if (unknown == nullptr) unknown = &field;
      context.warning_once("SPINDL/" + std::string(text), field.where,
                           "SPINDL: " + std::string(text.substr(0, 40)) + " is not known and was skipped" +
                               (has_number ? ", with a number behind it" : ""));
      continue;
    }
    says = true;
  }
  if (!says && unknown != nullptr) {
    return context.error(unknown->where, "SPINDL/" + std::string(unknown->text.substr(0, 40)) +
                                             " is not known, and the statement says nothing else: whether "
                                             "the spindle turns is not clear");
  }
  if (value && spindle.state != Spindle::State::orient) {
    if (surface_factor > 0.0) {
      if (!context.modal.origin.mill) {
        return refuse_lathe(context, statement.where,
                            "SPINDL with a surface speed, where no tool axis, MULTAX, MODE/MILL or milling "
                            "cutter shows a mill");
      }
      spindle.surface_speed_mm_s = *value * surface_factor;
    } else {
      spindle.speed_rpm = *value;
    }
  }
  // A speed of none is no speed that holds on: the spindle stands.
  if (value && *value == 0.0 && spindle.state == Spindle::State::on) {
    spindle = {};
    spindle.state = Spindle::State::off;
    counterclockwise.reset();
  }
  if (spindle.surface_speed_mm_s) context.modal.said.rpm = 0.0;
  if (spindle.speed_rpm) context.modal.said.rpm = *spindle.speed_rpm;
  if (!take_sense(context, statement, counterclockwise, spindle)) return;
  context.emit(statement.where, spindle);
}

void read_coolnt(Context& context, const Statement& statement) {
  struct Word {
    std::string_view word;
    Coolant::Kind kind;
  };
  static constexpr Word kKinds[] = {{"ON", Coolant::Kind::on},        {"OFF", Coolant::Kind::off},
                                    {"FLOOD", Coolant::Kind::flood},  {"MIST", Coolant::Kind::mist},
                                    {"TAP", Coolant::Kind::tap},      {"TAPKUL", Coolant::Kind::tap},
                                    {"THRU", Coolant::Kind::through}, {"THROUGH", Coolant::Kind::through},
                                    {"AIR", Coolant::Kind::air},      {"NOMORE", Coolant::Kind::off}};
  std::vector<Coolant::Kind> kinds;
  bool says = statement.fields.empty();
  bool is_unknown = false;
  for (const Field& field : statement.fields) {
    if (starts_number(field.text) || field.text.empty()) continue;  // pressure
    const Word* found = nullptr;
    for (const Word& known : kKinds) {
      if (known.word == field.text) found = &known;
    }
    if (found == nullptr) {
      is_unknown = true;
      context.warning_once(
          "COOLNT/" + std::string(field.text), field.where,
          "COOLNT: " + std::string(field.text.substr(0, 40)) + " is not known and was skipped");
      continue;
    }
    says = true;
    if (found->kind != Coolant::Kind::on) kinds.push_back(found->kind);  // COOLNT/FLOOD,ON
  }
  if (!says && is_unknown) return;
  // OFF with the name of a kind (COOLNT/OFF,FLOOD) switches it off.
  if (std::find(kinds.begin(), kinds.end(), Coolant::Kind::off) != kinds.end())
    kinds.assign(1, Coolant::Kind::off);
  // COOLNT/ON behind COOLNT/OFF brings back what ran before.
  if (kinds.empty()) kinds.push_back(context.modal.said.coolant);
  for (const Coolant::Kind kind : kinds) {
    if (kind != Coolant::Kind::off) context.modal.said.coolant = kind;
    context.emit(statement.where, Coolant{kind});
  }
}

void read_delay(Context& context, const Statement& statement) {
  const auto value = context.number(statement, 0);
  if (!value) return;
  if (*value < 0.0) {
    return context.error(statement.fields[0].where,
                         std::string(statement.word) + ": " + shortest_text(*value) + " is below 0");
  }
  Dwell dwell;
  const std::string_view unit = statement.fields.size() > 1 ? statement.fields[1].text : std::string_view{};
  if (statement.fields.size() > 2 || !(unit.empty() || unit == "REV" || unit == "SEC")) {
    const Field& field = statement.fields[statement.fields.size() > 2 ? 2 : 1];
    return context.error(field.where, std::string(statement.word) + ": '" +
                                          std::string(field.text.substr(0, 40)) +
                                          "' is not understood; DELAY/s, in seconds, and DELAY/n,REV are");
  }
  if (unit == "REV") {
    dwell.revolutions = *value;
  } else {
    dwell.seconds = *value;
  }
  context.emit(statement.where, dwell);
}

void read_stop(Context& context, const Statement& statement) {
  context.emit(statement.where, Stop{false});
}
void read_opstop(Context& context, const Statement& statement) {
  context.emit(statement.where, Stop{true});
}

// LINTOL/0.01  LINTOL/ON  LINTOL/OFF  LINTOL/RAPID,0.1  LINTOL/AXIS,0.0001
void read_lintol(Context& context, const Statement& statement) {
  Tolerance tolerance;
  bool said = false;
  for (std::size_t i = 0; i < statement.fields.size(); ++i) {
    const std::string_view text = statement.fields[i].text;
    if (text == "ON" || text == "OFF") {
      tolerance.on = text == "ON";
    } else if (text == "RAPID") {
      tolerance.applies = Tolerance::Applies::rapid;
    } else if (text == "AXIS") {
      tolerance.applies = Tolerance::Applies::axis;
    } else if (starts_number(text) && !tolerance.value_mm && !tolerance.axis_angle) {
      const auto value = context.positive(statement, i);
      if (!value) return;
      if (tolerance.applies == Tolerance::Applies::axis) {
        tolerance.axis_angle = *value;
      } else {
        tolerance.value_mm = *value * context.modal.mm_per_unit;
      }
    } else {
      return context.error(statement.fields[i].where,
                           "LINTOL: '" + std::string(text.substr(0, 40)) +
                               "' is not understood; ON, OFF, RAPID, AXIS or a tolerance is needed");
    }
    said = true;
  }
  if (!said) return context.error(statement.where, "LINTOL: no value");
  context.emit(statement.where, tolerance);
}

void read_fini(Context& context, const Statement& statement) {
  context.modal.ended = true;
  context.emit(statement.where, End{});
}

// LEFT or RIGHT, the plane, and the register as ADJUST,n, OSETNO,n or n.
void read_wear(Context& context, const Statement& statement) {
  CutterCompensation out;
  bool side = false;
  for (std::size_t i = 0; i < statement.fields.size(); ++i) {
    const std::string_view text = statement.fields[i].text;
    if (text == "OFF" || text == "LEFT" || text == "RIGHT") {
      using Side = CutterCompensation::Side;
      out.side = text == "OFF" ? Side::off : text == "LEFT" ? Side::left : Side::right;
      side = true;
    } else if (text == "ADJUST" || text == "OSETNO" || text == "XYPLAN" || text == "ON") {
      continue;
    } else if (const std::optional<double> number =
                   parse_number(text) ? context.number(statement, i) : std::nullopt;
               number && *number >= 1.0 && *number <= 999.0 && *number == std::floor(*number)) {
      out.wear_register = static_cast<std::uint32_t>(*number);
    } else {
      return context.error(
          statement.fields[i].where,
          "CUTCOM: '" + std::string(text.substr(0, 40)) +
              "' is not understood; LEFT, RIGHT or OFF, XYPLAN and a register from 1 to 999 are");
    }
  }
  if (!side) return context.error(statement.where, "CUTCOM: neither LEFT, RIGHT nor OFF");
  context.emit(statement.where, out);
}

// The file gives the contour to be compensated, or that of the tool's center: unless it says so (Creo), only
// the programmer knows.
void read_cutcom(Context& context, const Statement& statement) {
  const std::string_view side = statement.has_fields() ? statement.fields[0].text : std::string_view{};
  using Choice = ReaderOptions::CutterCompensation;
  if (context.options().cutter_compensation == Choice::wear) return read_wear(context, statement);
  if (side == "OFF") return;
  const bool center =
      context.modal.points_on_center || context.options().cutter_compensation == Choice::tool_center;
  if (!center) {
    return context.error(
        statement.where,
        "CUTCOM/" + std::string(side.substr(0, 40)) +
            " changes the geometry: whether the points are those of the tool's center the file "
            "does not say (--cutter-compensation tool-center or wear)");
  }
  context.warning_once("CUTCOM", statement.where,
                       "CUTCOM is left out: the points are those of the tool's center");
}

// SET/OFSETL,n: the register of the fixture's offset, as Creo writes it. Of SET/ADJUST,n nobody could show
// whether it is that or the register of a length. Other words behind SET set nothing here.
void read_set(Context& context, const Statement& statement) {
  const std::string_view what = statement.has_fields() ? statement.fields[0].text : std::string_view();
  if (what == "ADJUST") {
    return context.error(
        statement.where,
        "SET/ADJUST: a work offset, or the register of the tool's length? SET/OFSETL,n is the "
        "work offset, LOADTL/n,ADJUST,m the register");
  }
  if (what != "OFSETL") {
    return context.warning_once("SET", statement.where,
                                "SET/" + std::string(what.substr(0, 40)) + " is not acted on");
  }
  const auto index = context.whole(statement, 1);
  if (!index) return;
  if (*index < 1)
    return context.error(statement.fields[1].where, "SET: work offsets are numbered from 1 (G54) on");
  context.emit(statement.where, WorkOffset{*index});
}

constexpr WordReading kProcessWords[] = {
    {"CUTCOM", read_cutcom},       {"FEDRAT", read_fedrat},    {"SPINDL", read_spindl},
    {"COOLNT", read_coolnt},       {"DELAY", read_delay},      {"DWELL", read_delay},
    {"STOP", read_stop},           {"OPSTOP", read_opstop},    {"LINTOL", read_lintol},
    {"FINI", read_fini},           {"ROTABL", read_post_word}, {"LIMITS", read_post_lengths},
    {"CLEARP", read_post_lengths}, {"MAXDPM", read_post_word}, {"ROTATE", read_rotate},
    {"RETRCT", read_retrct},       {"SET", read_set}};

}  // namespace

std::span<const WordReading> process_words() {
  return kProcessWords;
}

}  // namespace trunnion::cl
