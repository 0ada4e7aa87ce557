#pragma once
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/config/key_record.hpp"
#include "trunnion/config/value.hpp"
#include "trunnion/geom/vec.hpp"

namespace trunnion::config {

/// Factor from the unit that ends a key (`length_mm`, `angle_deg`, `A0C_urad`, `rapid_mm_min`,
/// `temperature_degC`) to the internal unit (mm, rad, s, mm/s, rad/s, degC); nothing when the key ends in no
/// known unit.
std::optional<double> unit_factor_of_key(std::string_view key);

/// Reads one TOML table. Every getter reports what is wrong (missing, wrong type, not finite, a key without
/// its unit) to the Diagnostics with file:line:column and returns the fallback, so that one pass finds
/// everything. `finish` reports the keys that nobody asked for.
class Section {
 public:
  /// `value` must outlive the section; `name` is the path for messages ("axis[2]").
  Section(const Value& value, std::string name, std::string file, Diagnostics& diagnostics);

  bool has(std::string_view key) const { return value_->find(key) != nullptr; }
  SourceRef where() const { return value_->where; }
  SourceRef where(std::string_view key) const;
  const std::string& file() const { return file_; }
  const std::string& name() const { return name_; }

  /// A number with the unit in its key, in internal units; integers are accepted for reals.
  double quantity(std::string_view key);
  std::optional<double> find_quantity(std::string_view key);
  double quantity_or(std::string_view key, double fallback) { return find_quantity(key).value_or(fallback); }
  /// A number without a unit (a ratio, a count).
  std::optional<double> find_number(std::string_view key);
  std::optional<std::int64_t> find_integer(std::string_view key);
  std::string text(std::string_view key);
  std::optional<std::string> find_text(std::string_view key);
  bool flag_or(std::string_view key, bool fallback);
  /// Three numbers, in internal units when the key ends in one.
  Vec3 vector(std::string_view key);
  std::optional<Vec3> find_vector(std::string_view key);
  std::optional<std::vector<double>> find_numbers(std::string_view key);
  std::vector<std::string> texts(std::string_view key);
  std::optional<std::vector<std::string>> find_texts(std::string_view key);
  /// A child table / the tables of an array of tables (empty when absent).
  std::optional<Section> find_section(std::string_view key);
  std::vector<Section> sections(std::string_view key);
  /// All keys of this table, in the order of the file; marks them as asked for (tables with free keys).
  /// `pattern`: a regular expression of those that the caller takes; empty: none (they only count as asked
  /// for).
  std::vector<std::string> keys(std::string_view pattern = "^.+$");
  /// Raw access; marks the key as asked for. `type`: what the caller takes there.
  const Value* raw(std::string_view key, KeyType type = KeyType::other);
  /// The texts that the caller takes behind `key`, for tables of keys.
  void takes(std::string_view key, const std::vector<std::string>& choices);

  /// Reports an error at a key (or at the table itself when the key is absent).
  void error(std::string_view key, const std::string& message);
  void warning(std::string_view key, const std::string& message);
  /// Reports every key that was not asked for; a misspelt key is never ignored.
  void finish();

  Diagnostics& diagnostics() { return *diagnostics_; }

 private:
  const Value* require(std::string_view key, KeyType type);
  const Value* lookup(std::string_view key, KeyType type);
  std::optional<std::vector<double>> numbers_of(std::string_view key, KeyType type);
  std::optional<double> number_of(std::string_view key, const Value& value, double factor);
  const Value* value_;
  std::string name_;
  std::string file_;
  Diagnostics* diagnostics_;
  std::set<std::string, std::less<>> asked_;
};

}  // namespace trunnion::config
