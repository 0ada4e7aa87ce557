#include <algorithm>
#include <cstdint>
#include <string>

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

/// The UTF-8 character at the front of `text`; its length is 0 when there is none.
struct Utf8 {
  std::uint32_t code = 0;
  std::size_t length = 0;
};
Utf8 utf8_at(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i]));
  };
  const std::uint32_t first = byte(0);
  if (first < 0x80U) return {first, 1};
  const std::size_t length = first >= 0xF0U ? 4 : first >= 0xE0U ? 3 : 2;
  if (first < 0xC2U || first > 0xF4U || text.size() < length) return {};
  std::uint32_t code = first & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return {};
    code = (code << 6U) | (byte(i) & 0x3FU);
  }
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // a longer form than needed is none
  if (code < kLeast[length] || code > 0x10FFFFU || (code >= 0xD800U && code < 0xE000U)) return {};
  return {code, length};
}

bool acts(std::uint32_t code) {
  const auto within = [code](std::uint32_t first, std::uint32_t last) {
    return code >= first && code <= last;
  };
  return within(0x7F, 0x9F) || (code < 0x20 && code != '\t') || within(0x200B, 0x200F) ||
         within(0x2028, 0x202E) || within(0x2060, 0x206F) || code == 0xFEFF || within(0xFFF9, 0xFFFB);
}

}  // namespace

std::string shown_text(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const Utf8 next = utf8_at(text);
    if (next.length == 0 || acts(next.code)) {
      out += '?';
    } else {
      out += text.substr(0, next.length);
    }
    text.remove_prefix(std::max<std::size_t>(next.length, 1));
  }
  return out;
}

namespace {

void emit_text(Context& context, const Statement& statement, Text::Kind kind) {
  context.emit(statement.where, Text{kind, shown_text(statement.text)});
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
  const std::size_t comma = std::min(statement.text.find(','), statement.text.size());
  const std::string_view name = statement.text.substr(0, comma);
  constexpr std::string_view kTool = ",TOOL,";
  const std::string_view behind = statement.text.substr(comma);
  context.refuse_under_cycle(statement.where, "an operation begins");
  context.begin_operation(statement.where,
                          behind.starts_with(kTool) ? behind.substr(kTool.size()) : std::string_view{});
  context.modal.closing = "END-OF-PATH";
  context.emit(statement.where, OperationBegin{shown_text(name)});
}
void read_end_of_path(Context& context, const Statement& statement) {
  context.modal.closing = {};
  context.end_operation();
  context.emit(statement.where, OperationEnd{});
}

// CAMplete: the operation that begins.
void read_csi_tool_path(Context& context, const Statement& statement) {
  context.emit(statement.where, OperationBegin{shown_text(statement.text)});
}

constexpr WordReading kTextWordReadings[] = {{"CSI_TOOL_PATH", read_csi_tool_path},
                                             {"PARTNO", read_partno},
                                             {"PPRINT", read_pprint},
                                             {"INSERT", read_insert},
                                             {"TPRINT", read_other},
                                             {"LETTER", read_other},
                                             {"TITLES", read_other},
                                             {"TOOLPATH", read_toolpath},
                                             {"REMARK", skip},
                                             {"HEADER", skip},
                                             {"END-OF-PATH", read_end_of_path}};

}  // namespace

std::span<const WordReading> text_words() {
  return kTextWordReadings;
}

}  // namespace trunnion::cl
