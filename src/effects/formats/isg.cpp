// ISG_CSV of the ISG kernel (Beckhoff TF5280, "ISG CSV format", "Units of measure"): blocks of
// whitespace-separated columns, `//` comments, `#` alone between blocks. Arguments X Y Z A B C in mm and
// degrees, parameters in mm and rad. Any further argument column makes the table two-dimensional. Values are
// errors as they are, not corrections.
#include <algorithm>
#include <map>
#include <set>

#include "effects/formats/format_support.hpp"

namespace trunnion::formats {
namespace {

bool is_argument(std::string_view name) {
  return name.size() == 1 && std::string_view("XYZABC").find(name[0]) != std::string_view::npos;
}

bool is_component(const Machine& machine, std::string_view name) {
  return place_of_component(machine, name).has_value();
}

// X0C, EX0C, XOC (letter O), C0Y: a location error.
bool is_location(std::string_view name) {
  if (name.size() == 4 && name[0] == 'E') name.remove_prefix(1);
  return name.size() == 3 && (name[1] == '0' || name[1] == 'O') && is_argument(name.substr(0, 1)) &&
         is_argument(name.substr(2));
}

std::string location_name(std::string_view name) {
  if (name.size() == 4) name.remove_prefix(1);
  return std::string{name[0], '0', name[2]};
}

struct Block {
  std::vector<std::string> columns;
  std::uint32_t header = 0;
  std::vector<std::vector<double>> rows;
};

void add_table(const Block& block, const std::string& file, const Machine& machine, double sign,
               ControlTables& out, Diagnostics& diagnostics) {
  std::vector<std::size_t> arguments, components;
  for (std::size_t k = 0; k < block.columns.size(); ++k) {
    if (is_argument(block.columns[k])) {
      arguments.push_back(k);
      if (!machine.axis(block.columns[k]))
        return diagnostics.error(file, {block.header, static_cast<std::uint32_t>(k + 1)},
                                 "the machine has no axis " + block.columns[k]);
    } else if (is_component(machine, block.columns[k])) {
      components.push_back(k);
    } else if (is_location(block.columns[k])) {
      if (block.rows.size() != 1)
        return diagnostics.error(file, {block.header, 1},
                                 "location error " + block.columns[k] + " wants one row");
      out.location.emplace_back(location_name(block.columns[k]), sign * block.rows[0][k]);
    } else {
      return diagnostics.error(file, {block.header, static_cast<std::uint32_t>(k + 1)},
                               "unknown column '" + block.columns[k] + "'");
    }
  }
  if (components.empty()) return;
  if (arguments.empty() || arguments.size() > 2)
    return diagnostics.error(file, {block.header, 1},
                             std::to_string(arguments.size()) + " arguments; one or two are read");
  ErrorTable table;
  table.file = file;
  std::vector<std::map<double, std::size_t>> index(arguments.size());
  for (std::size_t a = 0; a < arguments.size(); ++a) {
    table.arguments.push_back(block.columns[arguments[a]]);
    const double factor = position_factor(machine.axes[*machine.axis(table.arguments.back())]);
    for (const auto& row : block.rows) index[a][row[arguments[a]]] = 0;
    table.nodes.emplace_back();
    for (auto& [value, place] : index[a]) {
      place = table.nodes.back().size();
      table.nodes.back().push_back(value * factor);
    }
  }
  const std::size_t width = arguments.size() > 1 ? index[1].size() : 1, total = index[0].size() * width;
  if (block.rows.size() != total)
    return diagnostics.error(file, {block.header, 1},
                             "parameter values are not on a grid: " + std::to_string(block.rows.size()) +
                                 " rows, the grid has " + std::to_string(total) + " nodes");
  for (const std::size_t k : components)
    table.components.push_back({block.columns[k], std::vector<double>(total, 0.0)});
  std::set<std::size_t> seen;
  for (const auto& row : block.rows) {
    const std::size_t at =
        index[0][row[arguments[0]]] * width + (arguments.size() > 1 ? index[1][row[arguments[1]]] : 0);
    if (!seen.insert(at).second)
      return diagnostics.error(file, {block.header, 1}, "a node of the grid stands twice");
    for (std::size_t c = 0; c < components.size(); ++c)
      table.components[c].values[at] = sign * row[components[c]];
  }
  out.errors.push_back(std::move(table));
}

Result<ControlTables> read_isg(std::string_view text, const std::string& file, const Machine& machine,
                               const FormatOptions& options, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.error_count();
  ControlTables out;
  Block block;
  const auto finish = [&] {
    if (!block.columns.empty())
      add_table(block, file, machine, options.negate ? -1.0 : 1.0, out, diagnostics);
    block = Block{};
  };
  for (const Line& line : lines_of(text)) {
    const std::string_view content = trim(line.text.substr(0, line.text.find("//")));
    if (content.empty()) continue;
    if (content.starts_with('#')) {
      finish();
      continue;
    }
    const auto words = words_of(content);
    if (block.columns.empty()) {
      block.columns.assign(words.begin(), words.end());
      block.header = line.number;
      continue;
    }
    if (words.size() != block.columns.size()) {
      diagnostics.error(file, {line.number, 1},
                        "row has " + std::to_string(words.size()) + " values, the header has " +
                            std::to_string(block.columns.size()));
      continue;
    }
    std::vector<double> row;
    row.reserve(words.size());
    for (const auto word : words)
      row.push_back(number_of(word, file, line.number, diagnostics).value_or(0.0));
    block.rows.push_back(std::move(row));
  }
  finish();
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  if (out.errors.empty() && out.location.empty())
    return fail(ErrorCode::wrong_input, "no error parameters", file);
  return out;
}

Result<std::string> write_isg(const ControlTables& tables, const Machine& machine,
                              const FormatOptions& options) {
  const double sign = options.negate ? -1.0 : 1.0;
  std::string out =
      "// errors as they are (actual - nominal of the carried body), mm and rad; arguments mm and deg\n";
  bool first = true;
  const auto new_block = [&] {
    if (!first) out += "#\n";
    first = false;
  };
  for (const ErrorTable& table : tables.errors) {
    new_block();
    std::string header;
    for (const std::string& axis : table.arguments) header += (header.empty() ? "" : "\t") + axis;
    for (const auto& component : table.components) header += "\t" + component.name;
    out += header + "\n";
    const std::size_t width = table.nodes.size() > 1 ? table.nodes[1].size() : 1;
    for (std::size_t i = 0; i < table.nodes[0].size(); ++i)
      for (std::size_t j = 0; j < width; ++j) {
        for (std::size_t a = 0; a < table.arguments.size(); ++a)
          out += (a == 0 ? "" : "\t") +
                 shortest_text(table.nodes[a][a == 0 ? i : j] /
                               position_factor(machine.axes[*machine.axis(table.arguments[a])]));
        for (const auto& component : table.components)
          out += "\t" + shortest_text(sign * component.values[i * width + j]);
        out += "\n";
      }
  }
  if (!tables.location.empty()) {
    new_block();
    std::string names, values;
    for (const auto& [name, value] : tables.location) {
      names += (names.empty() ? "" : "\t") + name;
      values += (values.empty() ? "" : "\t") + shortest_text(sign * value);
    }
    out += names + "\n" + values + "\n";
  }
  return out;
}

}  // namespace

TableFormat isg_format() {
  return {"isg", "ISG kernel and Beckhoff TF5280 CSV: error parameters over any axes", false, read_isg,
          write_isg};
}

}  // namespace trunnion::formats
