#include "trunnion/effects/table.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/printable.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"
#include "trunnion/config/section.hpp"
#include "trunnion/effects/library.hpp"

#include "effects/library_support.hpp"

namespace trunnion {
namespace {

struct Column {
  std::string name;
  double factor = 1.0;
  std::size_t index = 0;
};

// Of a component, internal units: what no machine errs by.
double largest_error(const Column& component) {
  const Unit unit = effects::is_rotation(component.name[1]) ? Unit::urad : Unit::um;
  return largest_value(unit) * unit_factor(unit);
}

struct Columns {
  std::vector<Column> arguments;
  std::vector<Column> components;
};

bool is_component(const std::string& name) {
  constexpr std::string_view kLetters = "XYZABC";
  return name.size() == 3 && name[0] == 'E' && kLetters.find(name[1]) != std::string_view::npos;
}

// Sorts one column into arguments or components; an error when it is neither or has a wrong unit. A column
// that is neither is not quoted: a model may name any file as its table, and what that holds is not for
// messages.
void classify(const config::CsvTable& csv, std::size_t index, const Machine& machine, Columns& out,
              Diagnostics& diagnostics) {
  const std::string& text = csv.columns[index];
  const SourceRef where{csv.header_line, static_cast<std::uint32_t>(index + 1)};
  const auto bar = text.rfind('_');
  const std::string stem = text.substr(0, bar);
  const std::string unit = bar == std::string::npos ? "" : text.substr(bar + 1);
  const auto factor = config::unit_factor_of_key(text);
  if (const auto id = machine.axis(stem)) {
    const bool rotary = machine.axes[*id].kind == AxisKind::rotary;
    if (unit != (rotary ? "deg" : "mm")) {
      diagnostics.error(
          csv.file, where,
          "argument column " + std::to_string(index + 1) + " must be '" + stem + (rotary ? "_deg'" : "_mm'"));
    }
    out.arguments.push_back({stem, factor.value_or(1.0), index});
  } else if (is_component(stem)) {
    const bool rotation = effects::is_rotation(stem[1]);
    const bool fits =
        rotation ? unit == "urad" || unit == "rad" || unit == "deg" : unit == "um" || unit == "mm";
    if (!fits) {
      diagnostics.error(csv.file, where,
                        "component column " + std::to_string(index + 1) + " must end in " +
                            (rotation ? "_urad or _rad" : "_um or _mm"));
    }
    out.components.push_back({stem, factor.value_or(1.0), index});
  } else {
    diagnostics.error(
        csv.file, where,
        "column " + std::to_string(index + 1) +
            " is neither an axis of the machine (X_mm, A_deg) nor an error component (EXX_um, EAX_urad)");
  }
}

// Positions within a billionth of the travel are one node: 0.1 + 0.2 and 0.3.
std::vector<double> distinct(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const double tolerance = 1e-9 * std::max(1.0, values.empty() ? 0.0 : values.back() - values.front());
  std::vector<double> out;
  for (const double v : values) {
    if (out.empty() || v - out.back() > tolerance) out.push_back(v);
  }
  return out;
}

std::size_t node_of(const std::vector<double>& nodes, double value) {
  const auto above = std::lower_bound(nodes.begin(), nodes.end(), value);
  if (above == nodes.begin()) return 0;
  const auto i = static_cast<std::size_t>(above - nodes.begin());
  return above == nodes.end() || value - nodes[i - 1] <= nodes[i] - value ? i - 1 : i;
}

std::string place_text(const ErrorTable& table, const Columns& columns, std::size_t flat) {
  const std::size_t second = table.nodes.size() > 1 ? table.nodes[1].size() : 1;
  std::string out =
      table.arguments[0] + " = " + shortest_text(table.nodes[0][flat / second] / columns.arguments[0].factor);
  if (table.nodes.size() > 1) {
    out += ", " + table.arguments[1] + " = " +
           shortest_text(table.nodes[1][flat % second] / columns.arguments[1].factor);
  }
  return out;
}

// Fills the grid; every node must stand there exactly once.
void fill(const config::CsvTable& csv, const Columns& columns,
          const std::vector<std::vector<double>>& numbers, ErrorTable& table, Diagnostics& diagnostics) {
  const std::size_t second = table.nodes.size() > 1 ? table.nodes[1].size() : 1;
  const std::size_t size = table.nodes[0].size() * second;
  // Rows that hardly share a value make a grid of millions of nodes, of which nearly all are missing.
  constexpr std::size_t kFewMissing = 100000;
  if (size > csv.rows.size() + kFewMissing) {
    diagnostics.error(csv.file, {csv.header_line, 1},
                      "the grid of " + std::to_string(table.nodes[0].size()) + " x " +
                          std::to_string(second) + " nodes has only " + std::to_string(csv.rows.size()) +
                          " rows");
    return;
  }
  for (const Column& c : columns.components)
    table.components.push_back({c.name, std::vector<double>(size, 0.0)});
  std::vector<std::uint32_t> line_of(size, 0);
  for (std::size_t r = 0; r < csv.rows.size(); ++r) {
    std::size_t flat = node_of(table.nodes[0], numbers[r][columns.arguments[0].index]) * second;
    if (table.nodes.size() > 1) flat += node_of(table.nodes[1], numbers[r][columns.arguments[1].index]);
    if (line_of[flat] != 0) {
      diagnostics.error(csv.file, {csv.rows[r].line, 1},
                        "node " + place_text(table, columns, flat) + " stands twice; first in line " +
                            std::to_string(line_of[flat]));
      continue;
    }
    line_of[flat] = csv.rows[r].line;
    for (std::size_t c = 0; c < columns.components.size(); ++c) {
      table.components[c].values[flat] = numbers[r][columns.components[c].index];
    }
  }
  const auto missing = std::find(line_of.begin(), line_of.end(), 0u);
  if (missing == line_of.end()) return;
  const auto count = std::count(line_of.begin(), line_of.end(), 0u);
  diagnostics.error(csv.file, {csv.header_line, 1},
                    "the grid of " + std::to_string(table.nodes[0].size()) + " x " + std::to_string(second) +
                        " nodes lacks " + std::to_string(count) + "; the first is " +
                        place_text(table, columns, static_cast<std::size_t>(missing - line_of.begin())));
}

void check_columns(const config::CsvTable& csv, const Columns& columns, Diagnostics& diagnostics) {
  const SourceRef header{csv.header_line, 1};
  if (columns.arguments.empty() || columns.arguments.size() > 2) {
    diagnostics.error(csv.file, header,
                      "an error table has one or two argument columns (X_mm, A_deg); this one has " +
                          std::to_string(columns.arguments.size()));
  }
  if (columns.components.empty())
    diagnostics.error(csv.file, header, "an error table has at least one component column (EXX_um)");
  if (csv.rows.size() < 2) diagnostics.error(csv.file, header, "an error table has at least 2 rows");
}

}  // namespace

const ErrorTable::Component* ErrorTable::component(std::string_view name) const {
  const auto it =
      std::find_if(components.begin(), components.end(), [&](const Component& c) { return c.name == name; });
  return it == components.end() ? nullptr : &*it;
}

Grid ErrorTable::grid(std::string_view name) const {
  const Component* c = component(name);
  TRUNNION_EXPECTS(c != nullptr);
  return {nodes[0], nodes.size() > 1 ? nodes[1] : std::vector<double>{}, c->values};
}

Result<ErrorTable> parse_error_table(std::string_view text, const std::string& file, const Machine& machine,
                                     Diagnostics& diagnostics) {
  const std::size_t errors = diagnostics.error_count();
  const auto csv = config::parse_csv(text, file, diagnostics);
  if (!csv) return tl::unexpected(csv.error());
  Columns columns;
  for (std::size_t i = 0; i < csv->columns.size(); ++i) classify(*csv, i, machine, columns, diagnostics);
  check_columns(*csv, columns, diagnostics);
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  std::vector<double> factors(csv->columns.size(), 1.0);
  for (const auto* list : {&columns.arguments, &columns.components}) {
    for (const Column& c : *list) factors[c.index] = c.factor;
  }
  std::vector<std::vector<double>> numbers;
  for (const auto& row : csv->rows) {
    std::vector<double> values;
    for (std::size_t i = 0; i < row.fields.size(); ++i) {
      values.push_back(config::csv_number(*csv, row, i, diagnostics).value_or(0.0) * factors[i]);
    }
    numbers.push_back(std::move(values));
  }
  for (const Column& c : columns.components) {
    for (std::size_t r = 0; r < numbers.size(); ++r) {
      if (std::abs(numbers[r][c.index]) <= largest_error(c)) continue;
      diagnostics.error(file, {csv->rows[r].line, static_cast<std::uint32_t>(c.index + 1)},
                        "'" + csv->rows[r].fields[c.index] + "' in column '" + csv->columns[c.index] +
                            "' is beyond what any machine errs by (100 mm, 0.1 rad): is it in another unit?");
    }
  }
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  ErrorTable table;
  table.file = file;
  table.comments = csv->comments;
  for (const Column& c : columns.arguments) {
    std::vector<double> values;
    values.reserve(numbers.size());
    for (const auto& row : numbers) values.push_back(row[c.index]);
    table.arguments.push_back(c.name);
    table.nodes.push_back(distinct(std::move(values)));
  }
  fill(*csv, columns, numbers, table, diagnostics);
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  return table;
}

Result<ErrorTable> load_error_table(const std::string& path, const Machine& machine,
                                    Diagnostics& diagnostics) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_error_table(*text, path, machine, diagnostics);
}

std::string error_table_text(const ErrorTable& table, const Machine& machine) {
  std::string out;
  for (const std::string& comment : table.comments)
    out.append("#").append(printable(comment, "\t")).append("\n");
  std::vector<double> factors;
  for (const std::string& name : table.arguments) {
    const auto id = machine.axis(name);
    TRUNNION_EXPECTS(id.has_value());
    const bool rotary = machine.axes[*id].kind == AxisKind::rotary;
    out += name + (rotary ? "_deg," : "_mm,");
    factors.push_back(rotary ? kRadPerDegree : 1.0);
  }
  for (const auto& c : table.components) {
    const bool rotation = effects::is_rotation(c.name[1]);
    out += c.name + (rotation ? "_urad" : "_um") + (&c == &table.components.back() ? "\n" : ",");
  }
  const std::size_t second = table.nodes.size() > 1 ? table.nodes[1].size() : 1;
  for (std::size_t flat = 0; flat < table.nodes[0].size() * second; ++flat) {
    out += shortest_text(table.nodes[0][flat / second] / factors[0]);
    if (table.nodes.size() > 1) out += "," + shortest_text(table.nodes[1][flat % second] / factors[1]);
    for (const auto& c : table.components) {
      out += "," + shortest_text(c.values[flat] / (effects::is_rotation(c.name[1]) ? kRadPerUrad : kMmPerUm));
    }
    out += "\n";
  }
  return out;
}

}  // namespace trunnion
