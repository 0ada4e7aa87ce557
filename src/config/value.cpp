#include "trunnion/config/value.hpp"

#include <algorithm>
#include <sstream>
#include <toml++/toml.h>

#include "trunnion/base/number_text.hpp"

namespace trunnion::config {
namespace {

SourceRef place(const toml::source_region& region) {
  return {static_cast<std::uint32_t>(region.begin.line), static_cast<std::uint32_t>(region.begin.column)};
}

Value convert(const toml::node& node);

Value convert_table(const toml::table& table) {
  Table out;
  for (const auto& [key, node] : table) {
    Value value = convert(node);
    value.where = place(key.source());
    out.emplace_back(std::string(key.str()), std::move(value));
  }
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) {
    return std::pair(a.second.where.line, a.second.where.column) <
           std::pair(b.second.where.line, b.second.where.column);
  });
  return {std::move(out), place(table.source())};
}

Value convert(const toml::node& node) {
  const SourceRef where = place(node.source());
  if (const auto* table = node.as_table()) return convert_table(*table);
  if (const auto* array = node.as_array()) {
    Array out;
    for (const auto& item : *array) out.push_back(convert(item));
    return {std::move(out), where};
  }
  if (const auto* v = node.as_boolean()) return {v->get(), where};
  if (const auto* v = node.as_integer()) return {v->get(), where};
  if (const auto* v = node.as_floating_point()) return {v->get(), where};
  if (const auto* v = node.as_string()) return {v->get(), where};
  std::ostringstream date;  // dates and times: kept as their text
  node.visit([&date](const auto& n) {
    if constexpr (toml::is_chronological<decltype(n)>) date << n.get();
  });
  return {date.str(), where};
}

std::string quoted(const std::string& text) {
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

bool bare_key(std::string_view key) {
  return !key.empty() &&
         key.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
             std::string_view::npos;
}

std::string key_text(const std::string& key) {
  return bare_key(key) ? key : quoted(key);
}

std::string real_text(double value) {
  std::string text = shortest_text(value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string inline_text(const Value& value) {
  if (const auto* v = std::get_if<bool>(&value.data)) return *v ? "true" : "false";
  if (const auto* v = std::get_if<std::int64_t>(&value.data)) return std::to_string(*v);
  if (const auto* v = std::get_if<double>(&value.data)) return real_text(*v);
  if (const auto* v = value.as_string()) return quoted(*v);
  std::string out;
  if (const auto* items = value.as_array()) {
    for (const auto& item : *items) out += (out.empty() ? "" : ", ") + inline_text(item);
    return "[" + out + "]";
  }
  for (const auto& [key, item] : *value.as_table()) {
    out += (out.empty() ? "" : ", ") + key_text(key) + " = " + inline_text(item);
  }
  return "{ " + out + " }";
}

bool is_table_array(const Value& value) {
  const auto* items = value.as_array();
  return items != nullptr && !items->empty() &&
         std::all_of(items->begin(), items->end(), [](const Value& v) { return v.as_table() != nullptr; });
}

void write_table(const Table& table, const std::string& path, std::string& out) {
  for (const auto& [key, value] : table) {
    if (value.as_table() == nullptr && !is_table_array(value))
      out += key_text(key) + " = " + inline_text(value) + "\n";
  }
  for (const auto& [key, value] : table) {
    const std::string child = path.empty() ? key_text(key) : path + "." + key_text(key);
    if (const auto* sub = value.as_table()) {
      out += (out.empty() ? "[" : "\n[") + child + "]\n";
      write_table(*sub, child, out);
    } else if (is_table_array(value)) {
      for (const auto& item : *value.as_array()) {
        out += (out.empty() ? "[[" : "\n[[") + child + "]]\n";
        write_table(*item.as_table(), child, out);
      }
    }
  }
}

}  // namespace

const Value* Value::find(std::string_view key) const {
  const auto* table = as_table();
  if (table == nullptr) return nullptr;
  const auto it =
      std::find_if(table->begin(), table->end(), [&](const auto& entry) { return entry.first == key; });
  return it == table->end() ? nullptr : &it->second;
}

const char* Value::kind() const {
  constexpr const char* kNames[] = {"true or false", "a whole number", "a number",
                                    "a string",      "an array",       "a table"};
  return kNames[data.index()];
}

Result<Value> parse_toml(std::string_view text, const std::string& file) {
  try {
    return convert_table(toml::parse(text, file));
  } catch (const toml::parse_error& e) {
    return fail(ErrorCode::wrong_input, std::string(e.description()), file, place(e.source()));
  }
}

std::string toml_text(const Value& root) {
  std::string out;
  if (const auto* table = root.as_table()) write_table(*table, "", out);
  return out;
}

}  // namespace trunnion::config
