#include "trunnion/config/section.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "trunnion/base/nearest_name.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/largest_number.hpp"

#include "config/key_recorder.hpp"

namespace trunnion::config {
namespace {

struct UnitSuffix {
  std::string_view suffix;
  double factor;
};

// Longest first: `_mm_min` must not be read as `_min`.
constexpr std::array kSuffixes = {
    UnitSuffix{"_um_per_m_K", 1e-6},
    UnitSuffix{"_um_per_K", kMmPerUm},
    UnitSuffix{"_mm_min", 1.0 / kSecondsPerMinute},
    UnitSuffix{"_deg_min", kRadPerDegree / kSecondsPerMinute},
    UnitSuffix{"_mm_s2", 1.0},
    UnitSuffix{"_mm_s3", 1.0},
    UnitSuffix{"_mm_s", 1.0},
    UnitSuffix{"_deg_s2", kRadPerDegree},
    UnitSuffix{"_deg_s3", kRadPerDegree},
    UnitSuffix{"_deg_s", kRadPerDegree},
    UnitSuffix{"_um_s", kMmPerUm},
    UnitSuffix{"_mm", 1.0},
    UnitSuffix{"_um", kMmPerUm},
    UnitSuffix{"_inch", kMmPerInch},
    UnitSuffix{"_deg", kRadPerDegree},
    UnitSuffix{"_urad", kRadPerUrad},
    UnitSuffix{"_rad", 1.0},
    UnitSuffix{"_degC", 1.0},
    UnitSuffix{"_K", 1.0},
    UnitSuffix{"_min", kSecondsPerMinute},
    UnitSuffix{"_ms", 1e-3},
    UnitSuffix{"_s", 1.0},
    UnitSuffix{"_rpm", 1.0},
};

const UnitSuffix* suffix_of(std::string_view key) {
  for (const auto& s : kSuffixes) {
    if (key.size() > s.suffix.size() && key.ends_with(s.suffix)) return &s;
  }
  return nullptr;
}

std::optional<double> plain_number(const Value& value) {
  if (const auto* v = std::get_if<double>(&value.data)) return *v;
  if (const auto* v = std::get_if<std::int64_t>(&value.data)) return static_cast<double>(*v);
  return std::nullopt;
}

}  // namespace

std::optional<double> unit_factor_of_key(std::string_view key) {
  const auto* s = suffix_of(key);
  return s ? std::optional(s->factor) : std::nullopt;
}

Section::Section(const Value& value, std::string name, std::string file, Diagnostics& diagnostics)
    : value_(&value), name_(std::move(name)), file_(std::move(file)), diagnostics_(&diagnostics) {
  if (value_->as_table() == nullptr) {
    diagnostics_->error(file_, value_->where, name_ + " must be a table, not " + value_->kind());
  }
  if (auto* recorder = KeyRecorder::active()) recorder->enter(*value_);
}

SourceRef Section::where(std::string_view key) const {
  const auto* v = value_->find(key);
  return v ? v->where : value_->where;
}

void Section::error(std::string_view key, const std::string& message) {
  diagnostics_->error(file_, where(key), message);
}
void Section::warning(std::string_view key, const std::string& message) {
  diagnostics_->warning(file_, where(key), message);
}

const Value* Section::lookup(std::string_view key, KeyType type) {
  asked_.emplace(key);
  if (auto* recorder = KeyRecorder::active()) recorder->asked(*value_, key, type);
  const auto* value = value_->find(key);
  if (value != nullptr) return value;
  // The same key without its unit: say which unit is meant instead of "missing" and "unknown".
  if (const auto* s = suffix_of(key)) {
    const std::string_view stem = key.substr(0, key.size() - s->suffix.size());
    if (value_->find(stem) != nullptr && asked_.emplace(stem).second) {
      error(stem, "key '" + std::string(stem) + "' has no unit: write '" + std::string(key) + "'");
    }
  }
  return nullptr;
}

const Value* Section::require(std::string_view key, KeyType type) {
  const std::size_t errors_before = diagnostics_->error_count();
  if (auto* recorder = KeyRecorder::active()) recorder->required(*value_, key);
  const auto* value = lookup(key, type);
  if (value == nullptr && value_->as_table() != nullptr && diagnostics_->error_count() == errors_before) {
    error(key, "missing key '" + std::string(key) + "' in [" + name_ + "]");
  }
  return value;
}

const Value* Section::raw(std::string_view key, KeyType type) {
  return lookup(key, type);
}

void Section::takes(std::string_view key, const std::vector<std::string>& choices) {
  if (auto* recorder = KeyRecorder::active()) recorder->choices(*value_, key, choices);
}

std::optional<double> Section::number_of(std::string_view key, const Value& value, double factor) {
  const auto number = plain_number(value);
  if (!number) {
    diagnostics_->error(file_, value.where,
                        "'" + std::string(key) + "' must be a number, not " + value.kind());
    return std::nullopt;
  }
  if (!std::isfinite(*number)) {
    diagnostics_->error(file_, value.where,
                        "'" + std::string(key) + "' must be a finite number, not " + shortest_text(*number));
    return std::nullopt;
  }
  if (std::abs(*number) > kLargestNumber) {
    diagnostics_->error(
        file_, value.where,
        "'" + std::string(key) + "' is beyond the range of numbers (9e15): " + shortest_text(*number));
    return std::nullopt;
  }
  return *number * factor;
}

double Section::quantity(std::string_view key) {
  const auto* value = require(key, KeyType::number);
  return value ? number_of(key, *value, unit_factor_of_key(key).value_or(1.0)).value_or(0.0) : 0.0;
}

std::optional<double> Section::find_quantity(std::string_view key) {
  const auto* value = lookup(key, KeyType::number);
  return value ? number_of(key, *value, unit_factor_of_key(key).value_or(1.0)) : std::nullopt;
}

std::optional<double> Section::find_number(std::string_view key) {
  const auto* value = lookup(key, KeyType::number);
  return value ? number_of(key, *value, 1.0) : std::nullopt;
}

std::optional<std::int64_t> Section::find_integer(std::string_view key) {
  const auto* value = lookup(key, KeyType::integer);
  if (value == nullptr) return std::nullopt;
  if (const auto* v = std::get_if<std::int64_t>(&value->data)) return *v;
  error(key, "'" + std::string(key) + "' must be a whole number, not " + value->kind());
  return std::nullopt;
}

std::string Section::text(std::string_view key) {
  require(key, KeyType::text);
  return find_text(key).value_or("");
}

std::optional<std::string> Section::find_text(std::string_view key) {
  const auto* value = lookup(key, KeyType::text);
  if (value == nullptr) return std::nullopt;
  if (const auto* v = value->as_string()) return *v;
  error(key, "'" + std::string(key) + "' must be a string, not " + value->kind());
  return std::nullopt;
}

bool Section::flag_or(std::string_view key, bool fallback) {
  const auto* value = lookup(key, KeyType::flag);
  if (value == nullptr) return fallback;
  if (const auto* v = std::get_if<bool>(&value->data)) return *v;
  error(key, "'" + std::string(key) + "' must be true or false, not " + value->kind());
  return fallback;
}

Vec3 Section::vector(std::string_view key) {
  require(key, KeyType::vector);
  return find_vector(key).value_or(Vec3::Zero());
}

std::optional<Vec3> Section::find_vector(std::string_view key) {
  const auto numbers = numbers_of(key, KeyType::vector);
  if (!numbers) return std::nullopt;
  if (numbers->size() != 3) {
    error(key, "'" + std::string(key) + "' must have 3 numbers, not " + std::to_string(numbers->size()));
    return std::nullopt;
  }
  return Vec3((*numbers)[0], (*numbers)[1], (*numbers)[2]);
}

std::optional<std::vector<double>> Section::find_numbers(std::string_view key) {
  return numbers_of(key, KeyType::numbers);
}

std::optional<std::vector<double>> Section::numbers_of(std::string_view key, KeyType type) {
  const auto* value = lookup(key, type);
  if (value == nullptr) return std::nullopt;
  const auto* items = value->as_array();
  if (items == nullptr) {
    error(key, "'" + std::string(key) + "' must be an array of numbers, not " + value->kind());
    return std::nullopt;
  }
  const double factor = unit_factor_of_key(key).value_or(1.0);
  std::vector<double> out;
  for (const auto& item : *items) {
    const auto number = number_of(key, item, factor);
    if (!number) return std::nullopt;
    out.push_back(*number);
  }
  return out;
}

std::vector<std::string> Section::texts(std::string_view key) {
  require(key, KeyType::texts);
  return find_texts(key).value_or(std::vector<std::string>{});
}

std::optional<std::vector<std::string>> Section::find_texts(std::string_view key) {
  const auto* value = lookup(key, KeyType::texts);
  if (value == nullptr) return std::nullopt;
  const auto* items = value->as_array();
  if (items == nullptr) {
    error(key, "'" + std::string(key) + "' must be an array of strings, not " + value->kind());
    return std::nullopt;
  }
  std::vector<std::string> out;
  for (const auto& item : *items) {
    if (const auto* v = item.as_string()) {
      out.push_back(*v);
    } else {
      diagnostics_->error(file_, item.where,
                          "'" + std::string(key) + "' must hold strings, not " + item.kind());
      return std::nullopt;
    }
  }
  return out;
}

std::optional<Section> Section::find_section(std::string_view key) {
  const auto* value = lookup(key, KeyType::table);
  if (value == nullptr) return std::nullopt;
  if (auto* recorder = KeyRecorder::active()) recorder->step(*value_, key, *value);
  return Section(*value, std::string(key), file_, *diagnostics_);
}

std::vector<Section> Section::sections(std::string_view key) {
  std::vector<Section> out;
  const auto* value = lookup(key, KeyType::tables);
  if (value == nullptr) return out;
  const auto* items = value->as_array();
  if (items == nullptr) {
    error(key, "'" + std::string(key) + "' must be an array of tables: write [[" + std::string(key) + "]]");
    return out;
  }
  for (const auto& item : *items) {
    if (auto* recorder = KeyRecorder::active()) recorder->step(*value_, key, item);
    out.emplace_back(item, std::string(key) + "[" + std::to_string(out.size() + 1) + "]", file_,
                     *diagnostics_);
  }
  return out;
}

std::vector<std::string> Section::keys(std::string_view pattern) {
  std::vector<std::string> out;
  if (auto* recorder = KeyRecorder::active()) recorder->pattern(*value_, pattern);
  if (const auto* table = value_->as_table()) {
    for (const auto& [key, value] : *table) {
      out.push_back(key);
      asked_.insert(key);
    }
  }
  return out;
}

void Section::finish() {
  const auto* table = value_->as_table();
  if (table == nullptr) return;
  for (const auto& [key, value] : *table) {
    if (!asked_.contains(key))
      diagnostics_->error(
          file_, value.where,
          "unknown key '" + key + "' in [" + name_ + "]" + did_you_mean(key, {asked_.begin(), asked_.end()}));
  }
}

}  // namespace trunnion::config
