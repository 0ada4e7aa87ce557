#pragma once
#include <set>
#include <string>
#include <string_view>

#include "trunnion/base/field_text.hpp"

namespace trunnion::thermal {

/// Another program's table as plain CSV: the same lines, commas between the fields, points in the numbers,
/// nothing where a logger writes that it has no value, dates and times as seconds since 1970.
struct ForeignText {
  std::string csv;
  std::set<std::size_t> dated;  // columns that held dates and times
  std::size_t not_read = 0;     // fields like N/A
};

/// @param delimiter   between fields; 0: tab, semicolon, bar or comma, the first of them in the header
/// @param skip_lines  lines before the header
ForeignText plain_csv(std::string_view text, char delimiter, std::size_t skip_lines);

}  // namespace trunnion::thermal
