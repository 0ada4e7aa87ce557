// Tool files: CSV, and the tool table of LinuxCNC.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/config/csv.hpp"
#include "trunnion/post/tools.hpp"

namespace trunnion::post {
namespace {

constexpr double kLongestTool_mm = 10000.0;
constexpr std::uint32_t kLargestToolNumber = 99999999;

std::uint32_t column_of(std::string_view line, std::string_view word) {
  return static_cast<std::uint32_t>(word.data() - line.data()) + 1;
}

std::optional<std::uint32_t> tool_number(double value) {
  if (!(value >= 0.0) || value > kLargestToolNumber || value != std::floor(value)) return std::nullopt;
  return static_cast<std::uint32_t>(value);
}

bool is_gauge_length(double value) {
  return value > 0.0 && value <= kLongestTool_mm;
}

std::string not_a_length(double value) {
  return shortest_text(value) + " is not a gauge length: more than 0 and at most " +
         shortest_text(kLongestTool_mm) + " mm";
}

/// A tool table of CSV, row by row.
class CsvTools {
 public:
  CsvTools(std::string_view text, const std::string& file, Diagnostics& diagnostics)
      : rows_(text, file, diagnostics), findings_(diagnostics) {}

  void read(ToolTable& out) {
    find_columns();
    if (!column_[kNumber] || !column_[kLength]) return;
    while (rows_.next()) take_row(out);
  }

 private:
  enum Column : std::size_t { kNumber, kLength, kRadius, kFlute, kRegister, kCount };
  static constexpr std::array<std::string_view, kCount> kNames = {"tool", "length_mm", "radius_mm",
                                                                  "flute_length_mm", "register"};

  void find_columns() {
    const SourceRef header{rows_.header_line(), 1};
    for (std::size_t i = 0; i < kCount; ++i) column_[i] = rows_.column(kNames[i]);
    for (const Column needed : {kNumber, kLength}) {
      if (!column_[needed])
        findings_.error(rows_.file(), header, "there is no column '" + std::string(kNames[needed]) + "'");
    }
    for (std::size_t i = 0; i < rows_.columns().size(); ++i) {
      const std::string& name = rows_.columns()[i];
      if (std::find(kNames.begin(), kNames.end(), name) != kNames.end()) continue;
      findings_.error(
          rows_.file(), {rows_.header_line(), static_cast<std::uint32_t>(i + 1)},
          "column '" + name + "' is not known: tool, length_mm, radius_mm, flute_length_mm, register");
    }
  }
  SourceRef at(Column column) const {
    return {rows_.line(), static_cast<std::uint32_t>(*column_[column] + 1)};
  }
  bool is_given(Column column) const { return column_[column] && !rows_.fields()[*column_[column]].empty(); }
  std::optional<std::uint32_t> number(Column column) {
    const auto value = rows_.number(*column_[column]);
    if (!value) return std::nullopt;
    const auto out = tool_number(*value);
    if (!out) findings_.error(rows_.file(), at(column), shortest_text(*value) + " is not a whole number");
    return out;
  }
  std::optional<double> length(Column column) {
    const auto value = rows_.number(*column_[column]);
    if (!value || is_gauge_length(*value)) return value;
    findings_.error(
        rows_.file(), at(column),
        column == kLength ? not_a_length(*value) : shortest_text(*value) + " is not a length in mm above 0");
    return std::nullopt;
  }
  void take_row(ToolTable& out) {
    const auto tool = number(kNumber);
    const auto length_mm = length(kLength);
    Tool row;
    if (length_mm) row.length_mm = *length_mm;
    if (is_given(kRadius)) row.radius_mm = length(kRadius);
    if (is_given(kFlute)) row.flute_length_mm = length(kFlute);
    if (is_given(kRegister)) row.length_register = number(kRegister);
    if (!tool || !length_mm) return;
    if (row.flute_length_mm && *row.flute_length_mm > *length_mm) {
      findings_.error(rows_.file(), at(kFlute),
                      "a flute of " + shortest_text(*row.flute_length_mm) + " mm on a tool that is " +
                          shortest_text(*length_mm) + " mm long");
      return;
    }
    if (!out.emplace(*tool, row).second)
      findings_.error(rows_.file(), at(kNumber), "tool " + std::to_string(*tool) + " stands here twice");
  }

  config::CsvRows rows_;
  Diagnostics& findings_;
  std::array<std::optional<std::size_t>, kCount> column_;
};

/// The words of a line of LinuxCNC's tool table: a letter and a number each, a comment behind `;`.
struct TableLine {
  std::optional<double> tool, length_mm, diameter_mm;
  std::uint32_t tool_column = 1, length_column = 1;
};

bool read_table_line(std::string_view line, const std::string& file, std::uint32_t number,
                     Diagnostics& diagnostics, TableLine& out) {
  const std::string_view words = line.substr(0, line.find(';'));
  std::size_t at = 0;
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  for (;;) {
    while (at < words.size() && is_blank(words[at])) ++at;
    if (at == words.size()) return true;
    std::size_t end = at;
    while (end < words.size() && !is_blank(words[end])) ++end;
    const std::string_view word = words.substr(at, end - at);
    const SourceRef where{number, column_of(line, word)};
    const auto refuse = [&](const std::string& why) {
      diagnostics.error(file, where, "'" + std::string(word.substr(0, 40)) + "' " + why);
      return false;
    };
    at = end;
    const char letter = static_cast<char>(std::toupper(static_cast<unsigned char>(word[0])));
    std::string_view digits = word.substr(1);
    if (digits.starts_with('+')) digits.remove_prefix(1);
    const auto value = parse_number(digits);
    if (!value) return refuse("is no word of a tool table: a letter and a number");
    switch (letter) {
      case 'T':
        out.tool = value.value;
        out.tool_column = where.column;
        break;
      case 'Z':
        out.length_mm = value.value;
        out.length_column = where.column;
        break;
      case 'D':
        out.diameter_mm = value.value;
        break;
      case 'P':
      case 'I':
      case 'J':
      case 'Q':
        break;
      default:
        if (std::string_view("XYABCUVW").find(letter) == std::string_view::npos)
          return refuse("is no word of a tool table");
        if (value.value != 0.0) return refuse("is an offset in another axis than Z: it is not understood");
    }
  }
}

void read_table(std::string_view text, const std::string& file, Diagnostics& diagnostics, ToolTable& out) {
  std::uint32_t number = 0;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    TableLine words;
    if (!read_table_line(line, file, number, diagnostics, words)) continue;
    if (!words.tool) {
      if (words.length_mm || words.diameter_mm)
        diagnostics.error(file, {number, 1}, "a tool without its number (T)");
      continue;
    }
    const auto tool = tool_number(*words.tool);
    if (!tool) {
      diagnostics.error(file, {number, words.tool_column},
                        "T" + shortest_text(*words.tool) + " is not a tool number");
      continue;
    }
    if (words.length_mm.value_or(0.0) == 0.0) continue;  // it was never measured
    if (!is_gauge_length(*words.length_mm)) {
      diagnostics.error(file, {number, words.length_column},
                        "T" + std::to_string(*tool) + ": Z" + not_a_length(*words.length_mm));
      continue;
    }
    Tool row;
    row.length_mm = *words.length_mm;
    if (words.diameter_mm.value_or(0.0) > 0.0) row.radius_mm = 0.5 * *words.diameter_mm;
    if (!out.emplace(*tool, row).second)
      diagnostics.error(file, {number, words.tool_column},
                        "T" + std::to_string(*tool) + " stands here twice");
  }
}

bool is_table(std::string_view file) {
  constexpr std::string_view kEnd = ".tbl";
  return file.size() >= kEnd.size() &&
         std::equal(kEnd.rbegin(), kEnd.rend(), file.rbegin(), [](char a, char b) {
           return a == static_cast<char>(std::tolower(static_cast<unsigned char>(b)));
         });
}

}  // namespace

Result<ToolTable> parse_tools(std::string_view text, const std::string& file, Diagnostics& diagnostics) {
  const std::size_t errors_before = diagnostics.error_count();
  ToolTable out;
  if (is_table(file)) {
    read_table(text, file, diagnostics, out);
  } else {
    CsvTools(text, file, diagnostics).read(out);
  }
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  return out;
}

Result<ToolTable> load_tools(const std::string& path, Diagnostics& diagnostics) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_tools(*text, path, diagnostics);
}

}  // namespace trunnion::post
