#pragma once
#include <string>
#include <string_view>

namespace trunnion {

/// `text` as it may go to a terminal: control characters (C0, C1, DEL), marks that turn the direction of
/// writing, line separators and bytes that are no UTF-8 become `\\x1b`, `\\u202e` and the like, so that no
/// text of an input acts there. `kept` are control characters that stay ("\n\t" of a table).
std::string printable(std::string_view text, std::string_view kept = {});

/// The same for JSON, of which it changes no meaning: such characters stand within its texts and become
/// `\\u202e` there. Ends of lines and what is no UTF-8 stay.
std::string printable_json(std::string_view json);

}  // namespace trunnion
