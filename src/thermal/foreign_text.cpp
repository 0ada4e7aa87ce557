#include "thermal/foreign_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <vector>

#include "trunnion/base/number_text.hpp"
#include "trunnion/config/csv.hpp"

namespace trunnion::thermal {

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

// Names as a table needs them: none empty, none twice.
void settle_names(std::vector<std::string>& names) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].empty()) names[i] = "column " + std::to_string(i + 1);
    const auto before = names.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(names.begin(), before, names[i]) != before) names[i] += " (" + std::to_string(i + 1) + ")";
  }
}

}  // namespace

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
