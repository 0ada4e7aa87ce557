#include "app/file_texts.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "trunnion/base/files.hpp"

#include "app/man_pages.hpp"
#include "app/options.hpp"

namespace trunnion::app {
namespace {

using config::KeyRecord;
using config::KeyType;
using config::TableRecord;
using Json = nlohmann::ordered_json;

struct Meaning {
  std::string unit;
  std::string text;
};
using Meanings = std::map<std::pair<std::string, std::string>, Meaning>;  // table, key

// Where the tables of keys stand: file of postconfigs/, and the heading above the table.
struct Explained {
  const char* kind;
  const char* file;
  const char* heading;
  const char* title;
};
constexpr std::array<Explained, 12> kExplained = {{
    {"machine", "README.md", "## Machine files", "machine file of trunnion"},
    {"controller", "README.md", "# Machine and controller files", "controller file of trunnion"},
    {"model", "files.md", "## Models of a machine's errors", "model of a machine's errors for trunnion"},
    {"plan", "files.md", "## Measurement plans", "measurement plan of trunnion"},
    {"thermal", "files.md", "## Thermal models", "thermal model of trunnion"},
    {"batch", "files.md", "## Manifests of batches", "manifest of trunnion batch"},
    {"maker", "files.md", "## Machines that are sold",
     "what is public of a machine, for trunnion machine new"},
    {"measurements", "files.md", "## Measurement files", "measurement file of trunnion"},
    {"tools", "files.md", "## Tool files", "tool file of trunnion"},
    {"trace", "files.md", "## Traces", "trace of a machine's axes for trunnion"},
    {"temperatures", "files.md", "## Temperature logs", "temperature log for trunnion"},
    {"offsets", "files.md", "## Thermal offsets", "thermal offsets for trunnion"},
}};

const Explained& explained(const std::string& kind) {
  return *std::find_if(kExplained.begin(), kExplained.end(),
                       [&](const Explained& e) { return e.kind == kind; });
}

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(' ');
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

// The words that stand in backticks.
std::vector<std::string> in_backticks(const std::string& text) {
  std::vector<std::string> out;
  for (auto at = text.find('`'); at != std::string::npos; at = text.find('`', at + 1)) {
    const auto end = text.find('`', at + 1);
    if (end == std::string::npos) break;
    out.push_back(text.substr(at + 1, end - at - 1));
    at = end;
  }
  return out;
}

// **[clamp.A]**, **[[axis]]**: the path of the table as the reader has it.
std::string table_of(const std::string& cell) {
  const auto begin = cell.find("**[");
  if (begin == std::string::npos) return {};
  std::string out = cell.substr(begin + 3, cell.find(']', begin) - begin - 3);
  if (out.starts_with('[')) out.erase(0, 1);
  return out == "clamp.A" ? "clamp.*" : out == "file" ? "" : out;
}

// | **[table]** `key`, `other` | unit | meaning |
void take_row(const std::string& line, std::string& table, Meanings& out) {
  std::vector<std::string> cells;
  std::istringstream in(line.substr(1));
  for (std::string cell; std::getline(in, cell, '|');) cells.push_back(cell);
  if (cells.size() < 3) return;
  if (cells[0].find("**[") != std::string::npos) table = table_of(cells[0]);
  std::string text = cells[2];
  for (std::size_t i = 3; i < cells.size(); ++i) text += "|" + cells[i];  // a bar within the meaning
  if (const auto end = text.find_last_not_of(" |"); end != std::string::npos) text.resize(end + 1);
  const Meaning meaning{trimmed(cells[1]), trimmed(text)};
  const std::string names =
      cells[0].substr(cells[0].rfind("**") == std::string::npos ? 0 : cells[0].rfind("**") + 2);
  const bool range = names.find("` ... `") != std::string::npos;  // `X` ... `C`: keys that a pattern covers
  std::vector<std::string> keys = in_backticks(names);
  if (range || keys.empty()) keys = {"*"};
  std::string suffix;
  if (names.find("each also with") != std::string::npos) {
    suffix = keys.back();
    keys.pop_back();
  }
  for (const std::string& key : keys) {
    out[{table, key}] = meaning;
    if (!suffix.empty()) out[{table, key + suffix}] = meaning;
  }
}

Result<Meanings> meanings_of(const std::string& kind) {
  const Explained& where = explained(kind);
  const auto text = read_file(postconfigs_folder() + "/" + where.file);
  if (!text) return tl::unexpected(text.error());
  Meanings out;
  std::istringstream in(*text);
  std::string table;
  bool here = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("#")) here = line == where.heading;
    const bool is_head = line.starts_with("| table, key") || line.starts_with("| column ");
    if (here && line.starts_with("| ") && !is_head) take_row(line, table, out);
  }
  return out;
}

Json type_schema(KeyType type) {
  switch (type) {
    case KeyType::number:
      return {{"type", "number"}};
    case KeyType::integer:
      return {{"type", "integer"}};
    case KeyType::text:
      return {{"type", "string"}};
    case KeyType::flag:
      return {{"type", "boolean"}};
    case KeyType::vector:
      return {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 3}, {"maxItems", 3}};
    case KeyType::numbers:
      return {{"type", "array"}, {"items", {{"type", "number"}}}};
    case KeyType::texts:
      return {{"type", "array"}, {"items", {{"type", "string"}}}};
    case KeyType::text_or_texts:
      return {{"type", {"string", "array"}}, {"items", {{"type", "string"}}}};
    case KeyType::table:
    case KeyType::tables:
      return {{"type", "object"}};
    case KeyType::other:
      break;
  }
  return Json::object();
}

// Makes the schema of one file out of the record of its reader.
class SchemaWriter {
 public:
  SchemaWriter(const FileKeys& keys, const Meanings& meanings) : keys_(keys), meanings_(meanings) {}

  Json table(const std::string& path, const config::FileRecord& record) const {
    std::vector<const KeyVariant*> variants;
    for (const KeyVariant& v : keys_.variants) {
      if (v.table == path) variants.push_back(&v);
    }
    if (variants.empty()) return plain_table(path, record);
    Json out = plain_table(path, variants.back()->record);
    for (auto v = variants.rbegin() + 1; v != variants.rend(); ++v) {
      Json condition = {{"required", {(*v)->key}}};
      if (!(*v)->pattern.empty()) condition["properties"] = {{(*v)->key, {{"pattern", (*v)->pattern}}}};
      out = {{"if", condition}, {"then", plain_table(path, (*v)->record)}, {"else", out}};
    }
    // Names of keys for editors, which do not look into conditions before they hold.
    Json names = Json::object();
    if (const auto all = keys_.record.find(path); all != keys_.record.end()) {
      for (const auto& [key, value] : all->second.keys) {
        if (key != "*")
          names[key] = described(path, key, value.choices.empty() ? Json::object() : choices(value));
      }
    }
    return {{"type", "object"}, {"properties", names}, {"allOf", Json::array({out})}};
  }

 private:
  static Json choices(const KeyRecord& record) { return {{"enum", record.choices}}; }

  Json described(const std::string& path, const std::string& key, Json schema) const {
    const auto meaning = meanings_.find({path, key});
    if (meaning != meanings_.end()) {
      const Meaning& m = meaning->second;
      schema["description"] = m.unit.empty() ? m.text : m.text.empty() ? m.unit : m.unit + ": " + m.text;
    }
    return schema;
  }

  Json plain_table(const std::string& path, const config::FileRecord& record) const {
    Json out = {{"type", "object"}};
    const auto found = record.find(path);
    if (found == record.end()) return out;
    const TableRecord& t = found->second;
    Json properties = Json::object();
    Json required = Json::array();
    for (const auto& [key, value] : t.keys) {
      if (key == "*") continue;
      properties[key] = described(path, key, key_schema(path, key, value, record));
      if (value.required == t.seen) required.push_back(key);
    }
    out["properties"] = properties;
    if (!required.empty()) out["required"] = required;
    if (!t.patterns.empty()) {
      const auto free = t.keys.find("*");
      for (const std::string& pattern : t.patterns)
        out["patternProperties"][pattern] =
            free == t.keys.end() ? Json::object() : key_schema(path, "*", free->second, record);
    }
    out["additionalProperties"] = false;
    return out;
  }

  Json key_schema(const std::string& path, const std::string& key, const KeyRecord& value,
                  const config::FileRecord& record) const {
    if (!value.choices.empty()) return choices(value);
    if (value.types.contains(KeyType::other)) return Json::object();
    const std::string below = (path.empty() ? "" : path + ".") + key;
    Json any = Json::array();
    for (const KeyType type : value.types) {
      if (type == KeyType::texts && value.types.contains(KeyType::text_or_texts)) continue;
      if (type == KeyType::table)
        any.push_back(table(below, record));
      else if (type == KeyType::tables)
        any.push_back({{"type", "array"}, {"items", table(below, record)}});
      else
        any.push_back(type_schema(type));
    }
    return any.size() == 1 ? any[0] : Json{{"anyOf", any}};
  }

  const FileKeys& keys_;
  const Meanings& meanings_;
};

const char* type_name(KeyType type) {
  switch (type) {
    case KeyType::number:
      return "number";
    case KeyType::integer:
      return "whole number";
    case KeyType::text:
      return "text";
    case KeyType::flag:
      return "true or false";
    case KeyType::vector:
      return "three numbers";
    case KeyType::numbers:
      return "list of numbers";
    case KeyType::texts:
      return "list of texts";
    case KeyType::text_or_texts:
      return "text or list of texts";
    case KeyType::table:
      return "table";
    case KeyType::tables:
      return "tables";
    case KeyType::other:
      break;
  }
  return "";
}

bool is_table_key(const KeyRecord& record) {
  return record.types.contains(KeyType::table) || record.types.contains(KeyType::tables);
}

// Backticks and stars of Markdown are not for man pages.
std::string plain_text(std::string text) {
  std::erase(text, '`');
  for (auto at = text.find("**"); at != std::string::npos; at = text.find("**")) text.erase(at, 2);
  return text;
}

std::string key_text(const std::string& key, const KeyRecord& record, const Meaning* meaning) {
  std::string types;
  if (record.choices.empty()) {
    for (const KeyType type : record.types) {
      if (type != KeyType::other) types += std::string(types.empty() ? "" : ", ") + type_name(type);
    }
  } else {
    for (const std::string& choice : record.choices) types += (types.empty() ? "\"" : ", \"") + choice + "\"";
  }
  std::string out = ".TP\n\\fB" + man_text(key == "*" ? "(name)" : key) + "\\fR";
  if (!types.empty()) out += " (" + man_text(types) + ")";
  out += "\n";
  if (meaning == nullptr) return out;
  const std::string said = meaning->unit.empty()   ? meaning->text
                           : meaning->text.empty() ? meaning->unit
                                                   : meaning->unit + ": " + meaning->text;
  return said.empty() ? out : out + man_text(plain_text(said)) + "\n";
}

}  // namespace

Result<std::string> file_schema(const std::string& kind) {
  const auto keys = keys_of_file(kind);
  if (!keys) return tl::unexpected(keys.error());
  const auto meanings = meanings_of(kind);
  if (!meanings) return tl::unexpected(meanings.error());
  Json out = {{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", explained(kind).title}};
  out.update(SchemaWriter(*keys, *meanings).table("", keys->record));
  return out.dump(1) + "\n";
}

Result<std::string> file_page(const std::string& kind) {
  const auto keys = keys_of_file(kind);
  if (!keys) return tl::unexpected(keys.error());
  const auto meanings = meanings_of(kind);
  if (!meanings) return tl::unexpected(meanings.error());
  const std::string name = "trunnion-" + kind;
  std::string out =
      man_head(name, 5) + ".SH NAME\n" + man_text(name) + " \\- " + man_text(explained(kind).title) +
      "\n.SH DESCRIPTION\nA TOML file. Units are in the keys; an unknown key, a missing one and a wrong type "
      "are errors "
      "with their place. A JSON Schema for editors is in the folder schemas/ of the program's data.\n";
  for (const auto& [path, table] : keys->record) {
    const bool only_tables = std::all_of(table.keys.begin(), table.keys.end(),
                                         [](const auto& k) { return is_table_key(k.second); });
    if (path.empty() && only_tables) continue;
    const auto dot = path.rfind('.');
    const auto parent = keys->record.find(dot == std::string::npos ? "" : path.substr(0, dot));
    const bool is_list = parent != keys->record.end() && !path.empty() &&
                         parent->second.keys.contains(path.substr(dot == std::string::npos ? 0 : dot + 1)) &&
                         parent->second.keys.at(path.substr(dot == std::string::npos ? 0 : dot + 1))
                             .types.contains(KeyType::tables);
    out += ".SH \"" +
           man_text(path.empty() ? "THE FILE ITSELF"
                    : is_list    ? "[[" + path + "]]"
                                 : "[" + path + "]") +
           "\"\n";
    for (const auto& [key, record] : table.keys) {
      const auto meaning = meanings->find({path, key});
      out += key_text(key, record, meaning == meanings->end() ? nullptr : &meaning->second);
    }
  }
  return out + ".SH SEE ALSO\n.BR trunnion (1)\n";
}

Result<std::string> column_page(const std::string& kind) {
  const auto meanings = meanings_of(kind);
  if (!meanings) return tl::unexpected(meanings.error());
  const std::string name = "trunnion-" + kind;
  std::string out =
      man_head(name, 5) + ".SH NAME\n" + man_text(name) + " \\- " + man_text(explained(kind).title) +
      "\n.SH DESCRIPTION\nCSV with a header line; lines that begin with # are comments. Columns in any "
      "order; one that is not known is an error.\n.SH COLUMNS\n";
  for (const auto& [place, meaning] : *meanings) out += key_text(place.second, {}, &meaning);
  return out + ".SH SEE ALSO\n.BR trunnion (1)\n";
}

Result<std::string> unexplained_keys(const std::string& kind) {
  const auto keys = keys_of_file(kind);
  if (!keys) return tl::unexpected(keys.error());
  const auto meanings = meanings_of(kind);
  if (!meanings) return tl::unexpected(meanings.error());
  std::string out;
  for (const auto& [path, table] : keys->record) {
    for (const auto& [key, record] : table.keys) {
      const std::string below = (path.empty() ? "" : path + ".") + key;
      if (!keys->record.contains(below) && !meanings->contains({path, key}))
        out += "not explained: [" + path + "] " + key + "\n";
    }
  }
  for (const auto& [place, meaning] : *meanings) {
    const auto table = keys->record.find(place.first);
    if (table == keys->record.end() || !table->second.keys.contains(place.second))
      out += "not read: [" + place.first + "] " + place.second + "\n";
  }
  return out;
}

}  // namespace trunnion::app
