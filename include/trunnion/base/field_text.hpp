#pragma once
#include <optional>
#include <string>
#include <string_view>

// What loggers and adapters write into a field.
namespace trunnion {

/// Without blanks at both ends.
std::string_view trimmed(std::string_view text);

/// `1.234,5` and `1234,5` with a point; any other text as it is.
std::string with_point(const std::string& field);

/// Seconds since 1970 of `2024-05-01T07:30:15.5+02:00` or `01.05.2024 07:30:15`, without a zone as UTC;
/// nothing for any other text.
std::optional<double> seconds_of_date(std::string_view text);

}  // namespace trunnion
