#include "trunnion/config/csv.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <csv.h>
#include <limits>
#include <memory>
#include <set>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/printable.hpp"
#include "trunnion/config/largest_number.hpp"

namespace trunnion::config {
namespace {

// Next line without its end; advances `text`.
std::string_view take_line(std::string_view& text) {
  const auto end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

std::string_view without_blanks(std::string_view field) {
  while (!field.empty() && is_blank(field.front())) field.remove_prefix(1);
  while (!field.empty() && is_blank(field.back())) field.remove_suffix(1);
  return field;
}

// Would begin a formula where a spreadsheet opens the file.
bool begins_formula(std::string_view text) {
  return !text.empty() && std::string_view("=+-@").find(text.front()) != std::string_view::npos;
}

std::string_view behind_marks(std::string_view text) {
  text.remove_prefix(std::min(text.size(), text.find_first_not_of('\'')));
  return text;
}

// The text of a field as it was before csv_field marked it.
std::string_view field_text(std::string_view field) {
  field = without_blanks(field);
  if (!field.empty() && field.front() == '\'' && begins_formula(behind_marks(field))) field.remove_prefix(1);
  return field;
}

ParsedNumber number_of(std::string_view text, bool decimal_comma) {
  const auto comma = decimal_comma ? text.find(',') : std::string_view::npos;
  std::string pointed;
  if (comma != std::string_view::npos && text.find('.') == std::string_view::npos) {
    pointed = text;
    pointed[comma] = '.';
    text = pointed;
  }
  ParsedNumber out = parse_number(text);
  if (out && std::abs(out.value) > kLargestNumber) out = {0.0, NumberFault::out_of_range};
  return out;
}

struct Field {
  std::string_view text, column;
  const std::string& file;
  SourceRef where;
};

// Reports why a field is no number.
void report_number(const Field& field, NumberFault fault, Diagnostics& diagnostics) {
  const char* why = fault == NumberFault::empty          ? "is empty"
                    : fault == NumberFault::out_of_range ? "is beyond the range of numbers (9e15)"
                                                         : "is not a number";
  constexpr std::size_t kShown = 60;  // a file without line ends is one field
  const std::string shown = field.text.size() <= kShown ? std::string(field.text)
                                                        : std::string(field.text.substr(0, kShown)) + "...";
  diagnostics.error(field.file, field.where,
                    "'" + shown + "' in column '" + std::string(field.column) + "' " + why);
}

}  // namespace

// libcsv splits the fields of a line; the lines are split outside, since a message needs their number.
class CsvRows::Splitter {
 public:
  Splitter() { csv_init(&parser_, CSV_STRICT | CSV_STRICT_FINI | CSV_APPEND_NULL); }
  Splitter(const Splitter&) = delete;
  Splitter& operator=(const Splitter&) = delete;
  ~Splitter() { csv_free(&parser_); }

  bool split(std::string_view line, char separator, std::vector<std::string_view>& fields) {
    held_.clear();
    csv_set_delim(&parser_, static_cast<unsigned char>(separator));
    const bool parsed = csv_parse(&parser_, line.data(), line.size(), on_field, nullptr, this) == line.size();
    const bool closed = csv_fini(&parser_, on_field, nullptr, this) == 0;
    fields.clear();
    for (const std::string& field : held_) fields.push_back(field_text(field));
    return parsed && closed;
  }

 private:
  static void on_field(void* data, std::size_t size, void* self) {
    static_cast<Splitter*>(self)->held_.emplace_back(static_cast<const char*>(data), size);
  }
  csv_parser parser_{};
  std::vector<std::string> held_;
};

std::optional<std::string> workbook_error(std::string_view text) {
  if (!text.starts_with("PK\x03\x04") && !text.starts_with("\xD0\xCF\x11\xE0")) return std::nullopt;
  return "this is a spreadsheet's own file (xlsx, ods, xls), no text: save the sheet as CSV, or "
         "xlsx2csv FILE.xlsx FILE.csv (Debian package xlsx2csv)";
}

CsvRows::CsvRows(std::string_view text, std::string file, Diagnostics& diagnostics)
    : text_(text),
      file_(std::move(file)),
      diagnostics_(&diagnostics),
      splitter_(std::make_unique<Splitter>()) {
  if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
  if (const auto error = workbook_error(text_)) {
    diagnostics_->error(file_, {1, 1}, *error);
    return;
  }
  const std::size_t errors_before = diagnostics_->error_count();
  while (columns_.empty()) {
    if (!take_row()) {
      if (diagnostics_->error_count() == errors_before)
        diagnostics_->error(file_, {1, 1}, "no header line: the file is empty");
      return;
    }
    columns_.assign(fields_.begin(), fields_.end());
  }
  header_line_ = line_;
  std::set<std::string_view> seen;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const SourceRef where{header_line_, static_cast<std::uint32_t>(i + 1)};
    if (columns_[i].empty()) {
      diagnostics_->error(file_, where, "column " + std::to_string(i + 1) + " has no name");
    } else if (!seen.insert(columns_[i]).second) {
      // Not quoted: a model may name any file as a table, and what it holds is not for messages.
      diagnostics_->error(file_, where,
                          "column " + std::to_string(i + 1) + " has a name that stands twice in the header");
    }
  }
}

CsvRows::CsvRows(CsvRows&&) noexcept = default;
CsvRows::~CsvRows() = default;

std::optional<std::size_t> CsvRows::column(std::string_view name) const {
  const auto it = std::find(columns_.begin(), columns_.end(), name);
  return it == columns_.end() ? std::nullopt : std::optional<std::size_t>(it - columns_.begin());
}

// The next line that is neither blank nor a comment, split; lines with faulty quotes are reported and left
// out.
bool CsvRows::take_row() {
  while (!text_.empty()) {
    const std::string_view line = take_line(text_);
    ++line_;
    if (line.find_first_not_of(" \t") == std::string_view::npos) continue;
    if (line.front() == '#') {
      comments_.emplace_back(line.substr(1));
      continue;
    }
    // The header decides.
    if (columns_.empty() && line.find(',') == std::string_view::npos &&
        line.find(';') != std::string_view::npos)
      separator_ = ';';
    if (line.find('"') != std::string_view::npos) {
      if (splitter_->split(line, separator_, fields_)) return true;
      diagnostics_->error(file_, {line_, 1}, "quotes are not closed or stand inside a field");
      continue;
    }
    fields_.clear();
    // Fields are short: a plain loop beats a search call for each separator.
    const char separator = separator_;
    const char* begin = line.data();
    const char* const end = begin + line.size();
    for (const char* p = begin; p != end; ++p) {
      if (*p != separator) continue;
      fields_.push_back(field_text({begin, static_cast<std::size_t>(p - begin)}));
      begin = p + 1;
    }
    fields_.push_back(field_text({begin, static_cast<std::size_t>(end - begin)}));
    return true;
  }
  return false;
}

bool CsvRows::next() {
  while (take_row()) {
    if (fields_.size() == columns_.size()) return true;
    diagnostics_->error(file_,
                        {line_, static_cast<std::uint32_t>(std::min(fields_.size(), columns_.size()) + 1)},
                        "row has " + std::to_string(fields_.size()) + " fields, the header has " +
                            std::to_string(columns_.size()));
  }
  return false;
}

std::optional<double> CsvRows::number(std::size_t column) {
  const ParsedNumber number = number_of(fields_[column], decimal_comma());
  if (number) return number.value;
  const SourceRef where{line_, static_cast<std::uint32_t>(column + 1)};
  report_number({fields_[column], columns_[column], file_, where}, number.fault, *diagnostics_);
  return std::nullopt;
}

std::optional<double> CsvRows::number_or_nan(std::size_t column) {
  if (fields_[column].empty()) return std::numeric_limits<double>::quiet_NaN();
  return number(column);
}

std::optional<std::size_t> CsvTable::column(std::string_view name) const {
  const auto it = std::find(columns.begin(), columns.end(), name);
  return it == columns.end() ? std::nullopt : std::optional<std::size_t>(it - columns.begin());
}

Result<CsvTable> parse_csv(std::string_view text, const std::string& file, Diagnostics& diagnostics) {
  const std::size_t errors_before = diagnostics.error_count();
  CsvRows rows(text, file, diagnostics);
  CsvTable table;
  table.file = file;
  while (!rows.columns().empty() && rows.next()) {
    table.rows.push_back({rows.line(), {rows.fields().begin(), rows.fields().end()}});
  }
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  table.decimal_comma = rows.decimal_comma();
  table.header_line = rows.header_line();
  table.columns = rows.columns();
  table.comments = rows.comments();
  return table;
}

std::optional<double> csv_number(const CsvTable& table, const CsvTable::Row& row, std::size_t column,
                                 Diagnostics& diagnostics) {
  const std::string& field = row.fields[column];
  const ParsedNumber number = number_of(without_blanks(field), table.decimal_comma);
  if (number) return number.value;
  const SourceRef where{row.line, static_cast<std::uint32_t>(column + 1)};
  report_number({field, table.columns[column], table.file, where}, number.fault, diagnostics);
  return std::nullopt;
}

std::string csv_field(std::string_view text) {
  std::string marked = printable(text, "\t\n\r");
  if (begins_formula(behind_marks(text)) && !parse_number(text)) marked.insert(0, 1, '\'');
  if (marked.find_first_of(",;\"\t\n\r") == std::string::npos && !marked.starts_with('#')) return marked;
  std::string out(2 * marked.size() + 2, '\0');
  out.resize(csv_write(out.data(), out.size(), marked.data(), marked.size()));
  return out;
}

}  // namespace trunnion::config
