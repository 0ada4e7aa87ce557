#include <string>

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

void emit_text(Context& context, const Statement& statement, Text::Kind kind) {
  context.emit(statement.where, Text{kind, std::string(statement.text)});
}
void read_partno(Context& context, const Statement& statement) {
  context.modal.closing = "FINI";
  emit_text(context, statement, Text::Kind::part_name);
}
void read_pprint(Context& context, const Statement& statement) {
  emit_text(context, statement, Text::Kind::print);
}
void read_insert(Context& context, const Statement& statement) {
  emit_text(context, statement, Text::Kind::insert);
}
void read_other(Context& context, const Statement& statement) {
  emit_text(context, statement, Text::Kind::other);
}
void skip(Context&, const Statement&) {}

// NX: TOOL PATH/operation,TOOL,tool
void read_toolpath(Context& context, const Statement& statement) {
  const std::string_view name = statement.text.substr(0, statement.text.find(','));
  context.modal.closing = "END-OF-PATH";
  context.emit(statement.where, OperationBegin{std::string(name)});
}
void read_end_of_path(Context& context, const Statement& statement) {
  context.modal.closing = {};
  context.emit(statement.where, OperationEnd{});
}

constexpr WordReading kTextWordReadings[] = {
    {"PARTNO", read_partno},          {"PPRINT", read_pprint}, {"INSERT", read_insert},
    {"TPRINT", read_other},           {"LETTER", read_other},  {"TITLES", read_other},
    {"TOOLPATH", read_toolpath},      {"REMARK", skip},        {"HEADER", skip},
    {"END-OF-PATH", read_end_of_path}};

}  // namespace

std::span<const WordReading> text_words() {
  return kTextWordReadings;
}

}  // namespace trunnion::cl
