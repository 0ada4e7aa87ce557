#pragma once
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace trunnion::thermal {

/// Without blanks at both ends.
std::string_view trimmed(std::string_view text);

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

/// Seconds since 1970 of `2024-05-01T07:30:15.5+02:00` or `01.05.2024 07:30:15`, without a zone as UTC;
/// nothing for any other text.
std::optional<double> seconds_of_date(std::string_view text);

}  // namespace trunnion::thermal
