#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"

namespace trunnion::config {

/// What is to be said of a spreadsheet's own file in place of a text (xlsx and ods are zip archives, xls is
/// an OLE container); nothing of any other.
std::optional<std::string> workbook_error(std::string_view text);

/// Reads a CSV text row by row without storing it, for logs of millions of rows; the rules are those of
/// CsvTable. A line without quotes is split in place, one with quotes goes through libcsv.
class CsvRows {
 public:
  /// Reads the comments and the header. `text` must outlive the reader. Errors: no header, a column twice or
  /// without a name.
  CsvRows(std::string_view text, std::string file, Diagnostics& diagnostics);
  CsvRows(CsvRows&&) noexcept;
  CsvRows& operator=(CsvRows&&) = delete;
  CsvRows(const CsvRows&) = delete;
  CsvRows& operator=(const CsvRows&) = delete;
  ~CsvRows();

  const std::string& file() const { return file_; }
  std::uint32_t header_line() const { return header_line_; }
  /// The header separates by semicolons: in numbers a comma is the decimal mark, as a point is.
  bool decimal_comma() const { return separator_ == ';'; }
  const std::vector<std::string>& columns() const { return columns_; }
  const std::vector<std::string>& comments() const { return comments_; }  // those read so far
  std::optional<std::size_t> column(std::string_view name) const;

  /// Goes to the next row that has as many fields as the header; faulty rows are reported and skipped. False
  /// at the end.
  bool next();
  std::uint32_t line() const { return line_; }
  /// Fields of the current row; valid until the next call of `next`.
  std::span<const std::string_view> fields() const { return fields_; }
  /// A number from a field of the current row; an empty or faulty one is reported and gives nothing.
  std::optional<double> number(std::size_t column);
  /// Same, but an empty field gives NaN ("nothing was measured"). Fast path for logs.
  std::optional<double> number_or_nan(std::size_t column);

 private:
  class Splitter;
  bool take_row();
  std::string_view text_;
  std::string file_;
  Diagnostics* diagnostics_;
  std::unique_ptr<Splitter> splitter_;
  char separator_ = ',';
  std::uint32_t line_ = 0;
  std::uint32_t header_line_ = 0;
  std::vector<std::string> columns_;
  std::vector<std::string> comments_;
  std::vector<std::string_view> fields_;
};

/// A CSV file with a header line: RFC 4180 fields (quotes as needed), lines starting with `#` are comments,
/// UTF-8 (a byte order mark is skipped), CRLF accepted. Where the header has semicolons and no commas they
/// separate the fields, and numbers may have a decimal comma.
struct CsvTable {
  struct Row {
    std::uint32_t line = 0;
    std::vector<std::string> fields;  // as many as there are columns
  };
  std::string file;
  std::uint32_t header_line = 0;
  bool decimal_comma = false;
  std::vector<std::string> columns;
  std::vector<std::string> comments;  // without the `#`
  std::vector<Row> rows;

  std::optional<std::size_t> column(std::string_view name) const;
};

/// Reads the whole table. Errors: no header, a column twice, a row with another number of fields, an open
/// quote. Every faulty row is reported with file:line:column (the column counts fields there).
Result<CsvTable> parse_csv(std::string_view text, const std::string& file, Diagnostics& diagnostics);

/// A number from a field, reported to `diagnostics` when it is none. Empty fields are an error here; ask
/// before.
std::optional<double> csv_number(const CsvTable& table, const CsvTable::Row& row, std::size_t column,
                                 Diagnostics& diagnostics);

/// One field as CSV text, quoted where it must be.
std::string csv_field(std::string_view text);

}  // namespace trunnion::config
