#include "thermal/foreign_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <optional>
#include <regex>
#include <vector>

#include "trunnion/base/number_text.hpp"
#include "trunnion/config/csv.hpp"

namespace trunnion::thermal {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0) text.remove_prefix(1);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.remove_suffix(1);
  return text;
}

namespace {

std::vector<std::string> split(std::string_view line, char delimiter) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"')
      quoted = !quoted;
    else if (c == delimiter && !quoted)
      out.emplace_back();
    else
      out.back() += c;
  }
  for (std::string& field : out) field = std::string(trimmed(field));
  return out;
}

char delimiter_of(std::string_view header) {
  for (const char c : {'\t', ';', '|'}) {
    if (header.find(c) != std::string_view::npos) return c;
  }
  return ',';
}

bool means_nothing(const std::string& field) {
  constexpr std::array kWords = {"n/a", "#n/a", "na",  "nan", "null",  "none",
                                 "-",   "--",   "---", "err", "error", "ol"};
  std::string lower;
  for (const char c : field) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::find(kWords.begin(), kWords.end(), lower) != kWords.end();
}

// `1.234,5` and `1234,5` with a point; any other text as it is.
std::string with_point(const std::string& field) {
  const auto comma = field.find(',');
  if (comma == std::string::npos || field.find(',', comma + 1) != std::string::npos) return field;
  std::string out = field;
  out[comma] = '.';
  out.erase(std::remove(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(comma), '.'),
            out.begin() + static_cast<std::ptrdiff_t>(comma));
  return parse_number(out) ? out : field;
}

// Names as a table needs them: none empty, none twice.
void settle_names(std::vector<std::string>& names) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].empty()) names[i] = "column " + std::to_string(i + 1);
    const auto before = names.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(names.begin(), before, names[i]) != before) names[i] += " (" + std::to_string(i + 1) + ")";
  }
}

}  // namespace

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

ForeignText plain_csv(std::string_view text, char delimiter, std::size_t skip_lines) {
  ForeignText out;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  bool header = true;
  for (std::size_t number = 0; !text.empty(); ++number) {
    const auto end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const bool left_out = number < skip_lines || trimmed(line).empty() || (!header && line.front() == '#');
    if (left_out || (header && line.front() == '#')) {
      out.csv += '\n';
      continue;
    }
    if (header && delimiter == 0) delimiter = delimiter_of(line);
    auto fields = split(line, delimiter);
    if (header) settle_names(fields);
    for (std::size_t i = 0; i < fields.size(); ++i) {
      std::string& field = fields[i];
      if (!header) {
        if (means_nothing(field)) {
          ++out.not_read;
          field.clear();
        } else if (const auto seconds = seconds_of_date(field)) {
          field = fixed_text(*seconds, 3);
          out.dated.insert(i);
        } else {
          field = with_point(field);
        }
      }
      if (i > 0) out.csv += ',';
      out.csv += config::csv_field(field);
    }
    header = false;
    out.csv += '\n';
  }
  return out;
}

}  // namespace trunnion::thermal
