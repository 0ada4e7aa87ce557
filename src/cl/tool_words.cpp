#include <array>
#include <string>

#include "trunnion/base/number_text.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

// Register words of LOADTL and LOAD/TOOL: the number behind them is the length register. That behind LENGTH
// is the gauge length.
bool is_register_word(std::string_view text) {
  return text == "ADJUST" || text == "OSETNO";
}

constexpr double kLongestTool_mm = 10000.0;  // that of a tool file

/// Measures of a cutter that none has, 0 for one that is not given.
bool is_a_cutter(Context& context, const Statement& statement, const std::optional<double>& diameter_mm,
                 const std::optional<double>& radius_mm) {
  const bool good = diameter_mm.value_or(0.0) >= 0.0 && diameter_mm.value_or(0.0) <= kLongestTool_mm &&
                    radius_mm.value_or(0.0) >= 0.0 && radius_mm.value_or(0.0) <= kLongestTool_mm;
  if (!good)
    context.error(statement.where, std::string(statement.word) + ": a diameter of " +
                                       short_text(diameter_mm.value_or(0.0)) + " mm and a corner radius of " +
                                       short_text(radius_mm.value_or(0.0)) + " mm are those of no cutter");
  return good;
}

/// The fields from `first` on are numbers.
bool is_plain(const Statement& statement, std::size_t first) {
  for (std::size_t i = first; i < statement.fields.size(); ++i) {
    if (!parse_number(statement.fields[i].text)) return false;
  }
  return true;
}

void read_tool_number(Context& context, const Statement& statement, std::size_t first) {
  const auto number = context.whole(statement, first);
  if (!number) return;
  context.refuse_under_cycle(statement.where, "a tool is loaded");
  context.modal.said.tool = *number;
  context.tool_loaded();
  ToolChange change{*number, std::nullopt, std::nullopt};
  const std::size_t given = statement.fields.size() - first;
  if ((given == 4 || given == 5) && is_plain(statement, first + 1)) {
    // LOADTL/tool,position,length,register (ISO 4343 as Fusion and HSMWorks write it), with that of the
    // diameter behind it in Autodesk's post of APT for MANUS. Their length is that of the tool out of its
    // holder: no gauge length.
    change.length_register = context.whole(statement, first + 3);
    if (!change.length_register) return;
    context.warning_once("LOADTL length", statement.fields[first + 2].where,
                         "LOADTL: " + std::string(statement.fields[first + 2].text.substr(0, 40)) +
                             " is the length of the tool out of its holder, no gauge length, and is not used "
                             "(--tools, --tool-length-mm, or LOADTL/n,LENGTH,l)");
    return context.emit(statement.where, change);
  }
  for (std::size_t i = first + 1; i < statement.fields.size(); ++i) {
    const bool is_length = statement.fields[i].text == "LENGTH";
    const bool is_register = is_register_word(statement.fields[i].text);
    if ((is_length && change.gauge_length_mm) || (is_register && change.length_register))
      return context.error(statement.fields[i].where,
                           std::string(statement.word) + ": a second " +
                               (is_length ? "LENGTH" : "length register (ADJUST, OSETNO)"));
    if (is_length) {
      const auto length = context.positive(statement, ++i);
      if (!length) return;
      if (*length * context.modal.mm_per_unit > kLongestTool_mm)
        return context.error(statement.fields[i].where, "LENGTH: a tool of " + short_text(*length) +
                                                            " is longer than " +
                                                            shortest_text(kLongestTool_mm) + " mm");
      context.use_unit(statement.where);
      change.gauge_length_mm = *length * context.modal.mm_per_unit;
    } else if (is_register) {
      change.length_register = context.whole(statement, ++i);
      if (!change.length_register) return;
    } else if (const std::string_view text = statement.fields[i].text; parse_number(text)) {
      const bool is_behind_word = i > first + 1 && !parse_number(statement.fields[i - 1].text);
      if (is_behind_word) continue;
      context.warning_once("LOADTL bare", statement.fields[i].where,
                           std::string(statement.word) + ": " + std::string(text.substr(0, 40)) +
                               " stands there without a word that says what it is, and is not read: a length "
                               "is LENGTH,l, its register ADJUST,n");
    } else if (!text.empty()) {
      context.warning_once("LOADTL/" + std::string(text), statement.fields[i].where,
                           std::string(statement.word) + ": " + std::string(text.substr(0, 40)) +
                               " is not known and was skipped, with what stands behind it");
    }
  }
  context.emit(statement.where, change);
}

void read_loadtl(Context& context, const Statement& statement) {
  read_tool_number(context, statement, 0);
}

// LOAD/TOOL,n[,ADJUST,m]. LOAD of anything else (a probe, a wire) is not ours.
void read_load(Context& context, const Statement& statement) {
  if (!statement.has_fields() || statement.fields[0].text != "TOOL") {
    const std::string what = statement.has_fields() ? std::string(statement.fields[0].text) : std::string();
    return context.error(statement.where, "LOAD/" + what + ": only LOAD/TOOL is understood");
  }
  read_tool_number(context, statement, 1);
}

void read_select(Context& context, const Statement& statement) {
  const bool tool = statement.has_fields() && statement.fields[0].text == "TOOL";
  const auto number = context.whole(statement, tool ? 1 : 0);
  if (number) context.emit(statement.where, ToolSelect{*number});
}

/// The numbers of a tool description from `first` on; empty fields are not given.
std::array<std::optional<double>, 10> lengths(Context& context, const Statement& statement, std::size_t first,
                                              bool& good) {
  std::array<std::optional<double>, 10> value;
  good = true;
  context.use_unit(statement.where);
  for (std::size_t i = 0; i < value.size() && first + i < statement.fields.size(); ++i) {
    if (statement.fields[first + i].text.empty()) continue;
    value[i] = context.number(statement, first + i);
    good = good && value[i].has_value();
    if (value[i]) *value[i] *= context.modal.mm_per_unit;
  }
  return value;
}

// CUTTER/d[,r[,e,f,alpha,beta[,h]]]: diameter, corner radius, centre of the corner (e, f), angles, height.
void read_cutter(Context& context, const Statement& statement) {
  if (!statement.has_fields()) return context.error(statement.where, "CUTTER: no value");
  bool good = false;
  const auto value = lengths(context, statement, 0, good);
  if (!good) return;
  const std::optional<double> height = value[6] && *value[6] != 0.0 ? value[6] : std::nullopt;
  if (height && *height < 0.0) {
    return context.error(statement.where,
                         "CUTTER: a height of " + shortest_text(*height) +
                             " mm; the seventh number is how far the cutter cuts up from its tip");
  }
  if (!is_a_cutter(context, statement, value[0], value[1])) return;
  // A lathe's cutter is its nose alone.
  if (statement.fields.size() > 1) context.modal.origin.mill = true;
  context.emit(statement.where, ToolGeometry{value[0], value[1], value[6], height});
}

// TLDATA/MILL,diameter,corner radius,length,taper,tip ...
// TLDATA/DRILL,module,diameter,corner radius,length,point angle,flute length: the module type (MILL) may be
// missing. Of the other kinds of mill, whatever their numbers are, nothing is known.
void read_tldata(Context& context, const Statement& statement) {
  if (!statement.has_fields()) return context.error(statement.where, "TLDATA: no kind of tool");
  const std::string_view kind = statement.fields[0].text;
  if (kind == "TURN" || kind == "GROOVE" || kind == "THREAD")
    return refuse_lathe(context, statement.where, "TLDATA/" + std::string(kind));
  context.modal.origin.mill = true;
  if (kind != "MILL" && kind != "DRILL") return;
  std::size_t first = 1;
  while (first < statement.fields.size() && !statement.fields[first].text.empty() &&
         !parse_number(statement.fields[first].text))
    ++first;
  bool good = false;
  const auto value = lengths(context, statement, first, good);
  if (!good || !is_a_cutter(context, statement, value[0], kind == "MILL" ? value[1] : std::nullopt)) return;
  if (kind == "MILL") {
    context.emit(statement.where, ToolGeometry{value[0], value[1], value[2]});
  } else {
    context.emit(statement.where, ToolGeometry{value[0], std::nullopt, std::nullopt});
  }
}

// TOOLNO/n,TURN: CATIA's tool change of a lathe. What it says of a mill's tool is that of LOADTL.
void read_toolno(Context& context, const Statement& statement) {
  for (std::size_t i = 0; i < statement.fields.size(); ++i) {
    const std::string_view text = statement.fields[i].text;
    if (text == "TURN") return refuse_lathe(context, statement.where, "TOOLNO/TURN");
    if (!is_register_word(text) && text != "LENGTH") continue;
    const std::string value =
        i + 1 < statement.fields.size() ? "," + std::string(statement.fields[i + 1].text.substr(0, 40)) : "";
    context.warning_once("TOOLNO/" + std::string(text), statement.fields[i].where,
                         "TOOLNO: " + std::string(text) + value +
                             " is not read: the length of a tool and its register are those of LOADTL");
  }
}

void read_unload(Context& context, const Statement& statement) {
  context.modal.said.unloaded = {statement.where, context.motion_count()};
}

constexpr WordReading kToolWords[] = {
    {"LOADTL", read_loadtl}, {"LOAD", read_load},     {"SELECT", read_select}, {"SELCTL", read_select},
    {"CUTTER", read_cutter}, {"TLDATA", read_tldata}, {"TOOLNO", read_toolno}, {"UNLOAD", read_unload}};

}  // namespace

std::span<const WordReading> tool_words() {
  return kToolWords;
}

}  // namespace trunnion::cl
