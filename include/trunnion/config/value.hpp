#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/base/source_ref.hpp"

namespace trunnion::config {

struct Value;
/// A type of its own: libstdc++ 12 takes a variant of scalars, strings and vectors alone for one that always
/// has a value, and where a copy of it runs out of memory it destroys by an index that was never set.
struct Array : std::vector<Value> {
  using std::vector<Value>::vector;
};
/// Keys in the order of the file.
using Table = std::vector<std::pair<std::string, Value>>;

/// A TOML value with the place where it stands.
struct Value {
  std::variant<bool, std::int64_t, double, std::string, Array, Table> data = Table{};
  SourceRef where;

  const Table* as_table() const { return std::get_if<Table>(&data); }
  const Array* as_array() const { return std::get_if<Array>(&data); }
  const std::string* as_string() const { return std::get_if<std::string>(&data); }
  /// The value of `key` when this is a table that has it.
  const Value* find(std::string_view key) const;
  /// What it is, for messages: "a number", "a string", "a table", ...
  const char* kind() const;
};

/// Parses TOML text; `file` is for messages. The result is the root table.
Result<Value> parse_toml(std::string_view text, const std::string& file);

/// TOML text of a root table: scalars and inline arrays first, then tables and arrays of tables; reads back
/// as the same Value.
std::string toml_text(const Value& root);

}  // namespace trunnion::config
