#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/source_ref.hpp"

namespace trunnion::cl {

/// Words that are a whole statement, without a slash.
inline constexpr std::array<std::string_view, 6> kBareWords = {"RAPID", "GOHOME", "FINI",
                                                               "STOP",  "OPSTOP", "REWIND"};

/// One value or minor word of a statement: upper case, blanks taken out.
struct Field {
  std::string_view text;
  SourceRef where;
  bool digits_far_apart = false;     // `5.        120`: the number of a card, or of a line
  bool blank_inside_number = false;  // `-1 15.0` was read as -115.0
};

/// One logical line, continuations joined.
struct Statement {
  enum class Kind : std::uint8_t {
    command,    // WORD/field,field,...
    text,       // PARTNO ... : `text` is the rest of the line
    directive,  // $$-> WORD / fields (Creo): a comment that carries data
    comment,    // $$ ... : `text` is what follows
  };
  Kind kind = Kind::command;
  std::string_view word;  // upper case, blanks taken out
  SourceRef where;        // of the word
  std::vector<Field> fields;
  std::string_view text;

  bool has_fields() const { return !fields.empty(); }
};

/// Six numbers of a GOTO that is written in the plain way.
struct PlainGoto {
  double value[6];
  int count = 0;  // 3 or 6
  std::uint8_t coordinate_decimals = 0;
  std::uint8_t axis_decimals = 0;
  SourceRef where;
};

}  // namespace trunnion::cl
