#include "trunnion/base/field_text.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <regex>

#include "trunnion/base/number_text.hpp"

namespace trunnion {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0) text.remove_prefix(1);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.remove_suffix(1);
  return text;
}

std::string with_point(const std::string& field) {
  const auto comma = field.find(',');
  if (comma == std::string::npos || field.find(',', comma + 1) != std::string::npos) return field;
  std::string out = field;
  out[comma] = '.';
  out.erase(std::remove(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(comma), '.'),
            out.begin() + static_cast<std::ptrdiff_t>(comma));
  return parse_number(out) ? out : field;
}

std::optional<double> seconds_of_date(std::string_view text) {
  static const std::regex kIso(
      R"((\d{4})[-/](\d{1,2})[-/](\d{1,2})[T ](\d{1,2}):(\d{2})(?::(\d{2}(?:[.,]\d+)?))?\s*(Z|[-+]\d{2}:?\d{2})?)");
  static const std::regex kGerman(
      R"((\d{1,2})\.(\d{1,2})\.(\d{4})[ T](\d{1,2}):(\d{2})(?::(\d{2}(?:[.,]\d+)?))?)");
  const std::string field(text);
  std::smatch m;
  const bool iso = std::regex_match(field, m, kIso);
  if (!iso && !std::regex_match(field, m, kGerman)) return std::nullopt;
  const auto number = [&m](std::size_t i) { return std::stoi(m[i].str()); };
  const std::chrono::year_month_day day{std::chrono::year{number(iso ? 1 : 3)},
                                        std::chrono::month{static_cast<unsigned>(number(2))},
                                        std::chrono::day{static_cast<unsigned>(number(iso ? 3 : 1))}};
  if (!day.ok()) return std::nullopt;
  const auto days = std::chrono::sys_days(day).time_since_epoch().count();
  constexpr double kMinute_s = 60.0;
  constexpr double kHour_s = 3600.0;
  constexpr double kDay_s = 86400.0;
  double out = kDay_s * static_cast<double>(days) + kHour_s * number(4) + kMinute_s * number(5);
  if (m[6].matched) out += parse_number(with_point(m[6].str())).value;
  if (iso && m[7].matched && m[7] != "Z") {
    const std::string zone = m[7].str();
    const int hours = std::stoi(zone.substr(1, 2));
    const int minutes = std::stoi(zone.substr(zone.size() - 2));
    out -= (zone[0] == '-' ? -1.0 : 1.0) * (kHour_s * hours + kMinute_s * minutes);
  }
  return out;
}

}  // namespace trunnion
