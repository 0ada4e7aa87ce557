#include "trunnion/config/value.hpp"

#include <algorithm>
#include <cctype>
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

// Of dotted keys, tables and arrays within each other.
constexpr std::size_t kDeepest = 64;

struct Fault {
  SourceRef where;
  std::string message;
};

std::string too_deep_text() {
  return "keys stand in each other more than " + std::to_string(kDeepest) + " deep";
}

// [name] or [[name]] at the start of `line`: does a name stand where one must?
bool names_a_table(std::string_view line) {
  line.remove_prefix(line.starts_with("[[") ? 2 : 1);
  const std::size_t at = line.find_first_not_of(" \t");
  if (at == std::string_view::npos) return false;
  const char c = line[at];
  return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
         std::string_view("_-\"'").find(c) != std::string_view::npos;
}

// What must not come to the parser, outside quotes and comments: a character that is not ASCII (TOML has none
// there, and what the parser does with some of them is undefined), a quote behind a value, a table's head
// without a name (the parser takes it for granted), a brace that closes where a value of an array must stand
// (likewise), and keys or brackets deeper than their tables can be taken down again.
std::optional<Fault> fault_before_parsing(std::string_view text) {
  SourceRef at{1, 0};
  std::size_t parts = 0;    // of the key, as far as it was read
  std::size_t open = 0;     // brackets and braces
  bool blank = true;        // the line, so far
  std::string_view quotes;  // that close the string; empty outside
  bool comment = false;
  char before = 0;  // the last character that is no blank, outside comments
  // The byte order mark is no character of the first line.
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  for (std::size_t i = text.starts_with(kMark) ? kMark.size() : 0; i < text.size();) {
    const char c = text[i];
    std::size_t length = 1;
    if (c == '\n') {
      comment = false;
      if (quotes.size() == 1) quotes = {};  // the parser will say that it is not closed
    } else if (!quotes.empty()) {
      if (text.substr(i).starts_with(quotes)) {
        length = quotes.size();
        // Up to two more quotes belong to the text.
        while (length > 1 && length < 5 && i + length < text.size() && text[i + length] == c) ++length;
        quotes = {};
      } else if (c == '\\' && quotes.front() == '"' && i + 1 < text.size() && text[i + 1] != '\n') {
        length = 2;
      }
    } else if (!comment) {
      if (static_cast<unsigned char>(c) >= 0x80)
        return Fault{{at.line, at.column + 1}, "a character that is not ASCII stands outside quotes"};
      // Behind a value the parser looks for its end, through the quotes.
      if ((c == '"' || c == '\'') && !blank &&
          std::string_view("=,[{.").find(before) == std::string_view::npos)
        return Fault{{at.line, at.column + 1}, "a quote stands where no text may begin"};
      if (std::string_view("=,[{#").find(c) != std::string_view::npos) parts = 0;
      if (c == '[' && blank && open == 0 && !names_a_table(text.substr(i, text.find('\n', i) - i)))
        return Fault{{at.line, at.column + 1}, "the head of a table without a name"};
      if (c == '}' && (before == '[' || before == ','))
        return Fault{{at.line, at.column + 1}, "'}' stands where a value must"};
      if ((c == '[' || c == '{') && ++open > kDeepest)
        return Fault{{at.line, at.column + 1}, too_deep_text()};
      if ((c == ']' || c == '}') && open > 0) --open;
      blank = blank && (c == ' ' || c == '\t');
      if (c == '.' && ++parts > kDeepest) return Fault{{at.line, at.column + 1}, too_deep_text()};
      comment = c == '#';
      if (!comment && std::string_view(" \t\r\v\f").find(c) == std::string_view::npos) before = c;
      for (const std::string_view kind : {R"(""")", "\'\'\'", R"(")", "\'"}) {
        if (!quotes.empty() || !text.substr(i).starts_with(kind)) continue;
        quotes = kind;
        length = kind.size();
      }
    }
    at.column += static_cast<std::uint32_t>(length);
    if (c == '\n') {
      at = {at.line + 1, 0};
      parts = 0;
      blank = true;
    }
    i += length;
  }
  return std::nullopt;
}

bool too_deep(const toml::node& node, std::size_t depth) {
  if (depth > kDeepest) return true;
  bool out = false;
  const auto look = [&](const toml::node& child) { out = out || too_deep(child, depth + 1); };
  if (const auto* table = node.as_table()) {
    for (const auto& [key, child] : *table) look(child);
  } else if (const auto* array = node.as_array()) {
    for (const auto& child : *array) look(child);
  }
  return out;
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
  constexpr std::size_t kLargestToml = std::size_t{16} << 20;  // the parser takes a hundred times its memory
  if (text.size() > kLargestToml)
    return fail(ErrorCode::wrong_input,
                "a TOML file has at most 16 MB, this one " + std::to_string(text.size()) + " bytes", file);
  if (auto fault = fault_before_parsing(text))
    return fail(ErrorCode::wrong_input, std::move(fault->message), file, fault->where);
  try {
    const toml::table root = toml::parse(text, file);
    if (too_deep(root, 0)) return fail(ErrorCode::wrong_input, too_deep_text(), file);
    return convert_table(root);
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
