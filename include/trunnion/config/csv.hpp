#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"

namespace trunnion::config {

/// A CSV file with a header line: RFC 4180 fields (quotes as needed), lines starting with `#` are comments,
/// UTF-8 (a byte order mark is skipped), CRLF accepted.
struct CsvTable {
  struct Row {
    std::uint32_t line = 0;
    std::vector<std::string> fields;  // as many as there are columns
  };
  std::string file;
  std::uint32_t header_line = 0;
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
