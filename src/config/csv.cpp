#include "trunnion/config/csv.hpp"

#include <algorithm>
#include <array>
#include <csv.h>
#include <memory>
#include <set>

#include "trunnion/base/number_text.hpp"

namespace trunnion::config {
namespace {

// libcsv splits the fields; the lines are split here, since a message needs their number.
class FieldSplitter {
 public:
  FieldSplitter() { csv_init(&parser_, CSV_STRICT | CSV_STRICT_FINI | CSV_APPEND_NULL); }
  FieldSplitter(const FieldSplitter&) = delete;
  FieldSplitter& operator=(const FieldSplitter&) = delete;
  ~FieldSplitter() { csv_free(&parser_); }

  bool split(std::string_view line, std::vector<std::string>& fields) {
    fields_ = &fields;
    fields.clear();
    const bool parsed = csv_parse(&parser_, line.data(), line.size(), on_field, nullptr, this) == line.size();
    return csv_fini(&parser_, on_field, nullptr, this) == 0 && parsed;
  }

 private:
  static void on_field(void* data, std::size_t size, void* self) {
    static_cast<FieldSplitter*>(self)->fields_->emplace_back(static_cast<const char*>(data), size);
  }
  csv_parser parser_{};
  std::vector<std::string>* fields_ = nullptr;
};

// Next line without its end; advances `text`.
std::string_view take_line(std::string_view& text) {
  const auto end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

void check_header(const CsvTable& table, Diagnostics& diagnostics) {
  std::set<std::string_view> seen;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const SourceRef where{table.header_line, static_cast<std::uint32_t>(i + 1)};
    if (table.columns[i].empty())
      diagnostics.error(table.file, where, "column " + std::to_string(i + 1) + " has no name");
    else if (!seen.insert(table.columns[i]).second)
      diagnostics.error(table.file, where, "column '" + table.columns[i] + "' stands twice in the header");
  }
}

}  // namespace

std::optional<std::size_t> CsvTable::column(std::string_view name) const {
  const auto it = std::find(columns.begin(), columns.end(), name);
  return it == columns.end() ? std::nullopt : std::optional<std::size_t>(it - columns.begin());
}

Result<CsvTable> parse_csv(std::string_view text, const std::string& file, Diagnostics& diagnostics) {
  CsvTable table;
  table.file = file;
  const std::size_t errors_before = diagnostics.error_count();
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  FieldSplitter splitter;
  std::vector<std::string> fields;
  for (std::uint32_t number = 1; !text.empty(); ++number) {
    const std::string_view line = take_line(text);
    if (line.find_first_not_of(" \t") == std::string_view::npos) continue;
    if (line.front() == '#') {
      table.comments.emplace_back(line.substr(1));
      continue;
    }
    if (!splitter.split(line, fields)) {
      diagnostics.error(file, {number, 1}, "quotes are not closed or stand inside a field");
      continue;
    }
    if (table.columns.empty()) {
      table.columns = fields;
      table.header_line = number;
      check_header(table, diagnostics);
    } else if (fields.size() != table.columns.size()) {
      diagnostics.error(
          file, {number, static_cast<std::uint32_t>(std::min(fields.size(), table.columns.size()) + 1)},
          "row has " + std::to_string(fields.size()) + " fields, the header has " +
              std::to_string(table.columns.size()));
    } else {
      table.rows.push_back({number, fields});
    }
  }
  if (table.columns.empty()) diagnostics.error(file, {1, 1}, "no header line: the file is empty");
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  return table;
}

std::optional<double> csv_number(const CsvTable& table, const CsvTable::Row& row, std::size_t column,
                                 Diagnostics& diagnostics) {
  const std::string& field = row.fields[column];
  const SourceRef where{row.line, static_cast<std::uint32_t>(column + 1)};
  const auto begin = field.find_first_not_of(" \t");
  const auto end = field.find_last_not_of(" \t");
  const auto number = begin == std::string::npos
                          ? ParsedNumber{0.0, NumberFault::empty}
                          : parse_number(std::string_view(field).substr(begin, end - begin + 1));
  if (number) return number.value;
  const char* why = number.fault == NumberFault::empty          ? "is empty"
                    : number.fault == NumberFault::out_of_range ? "is beyond the range of numbers"
                                                                : "is not a number";
  diagnostics.error(table.file, where, "'" + field + "' in column '" + table.columns[column] + "' " + why);
  return std::nullopt;
}

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\n\r") == std::string_view::npos && !text.starts_with('#'))
    return std::string(text);
  std::string out(2 * text.size() + 2, '\0');
  out.resize(csv_write(out.data(), out.size(), text.data(), text.size()));
  return out;
}

}  // namespace trunnion::config
