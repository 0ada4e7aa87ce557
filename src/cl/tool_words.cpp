#include <array>
#include <string>

#include "trunnion/base/number_text.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

// Register words of LOADTL and LOAD/TOOL: the number behind them is the length register.
bool is_register_word(std::string_view text) {
  return text == "ADJUST" || text == "OSETNO";
}

void read_tool_number(Context& context, const Statement& statement, std::size_t first) {
  const auto number = context.whole(statement, first);
  if (!number) return;
  ToolChange change{*number, std::nullopt};
  for (std::size_t i = first + 1; i < statement.fields.size(); ++i) {
    if (!is_register_word(statement.fields[i].text)) continue;
    change.length_register = context.whole(statement, ++i);
    if (!change.length_register) return;
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
  context.emit(statement.where, ToolGeometry{value[0], value[1], value[6]});
}

// TLDATA/MILL,diameter,corner radius,length,taper,tip: of the other kinds only what is the same in all of
// them.
void read_tldata(Context& context, const Statement& statement) {
  if (!statement.has_fields()) return context.error(statement.where, "TLDATA: no kind of tool");
  const std::string_view kind = statement.fields[0].text;
  if (kind != "MILL" && kind != "DRILL") return;
  bool good = false;
  const auto value = lengths(context, statement, 1, good);
  if (!good) return;
  if (kind == "MILL") {
    context.emit(statement.where, ToolGeometry{value[0], value[1], value[2]});
  } else {
    context.emit(statement.where, ToolGeometry{value[0], std::nullopt, std::nullopt});
  }
}

void skip_tool_word(Context&, const Statement&) {}

constexpr WordReading kToolWords[] = {
    {"LOADTL", read_loadtl}, {"LOAD", read_load},     {"SELECT", read_select},    {"SELCTL", read_select},
    {"CUTTER", read_cutter}, {"TLDATA", read_tldata}, {"TOOLNO", skip_tool_word}, {"UNLOAD", skip_tool_word}};

}  // namespace

std::span<const WordReading> tool_words() {
  return kToolWords;
}

}  // namespace trunnion::cl
