// ETALON_EXCHANGE (example in Beckhoff TF5280): `[C0B]` and `VALUE = v`, or `[EXY]` and `Gridpoints = {`
// lines `position value` `}`. mm and rad, positions mm and degrees; one argument each, the axis that the
// symbol names last.
#include "effects/formats/format_support.hpp"

namespace trunnion::formats {
namespace {

std::string upper(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return out;
}

Result<ControlTables> read_etalon(std::string_view text, const std::string& file, const Machine& machine,
                                  const FormatOptions& options, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.error_count();
  const double sign = options.negate ? -1.0 : 1.0;
  ControlTables out;
  std::string symbol;
  bool in_grid = false;
  for (const Line& line : lines_of(text)) {
    if (line.text.empty() || line.text.starts_with("//") || line.text.starts_with(';')) continue;
    const auto error = [&](const std::string& message) {
      diagnostics.error(file, {line.number, 1}, message);
    };
    if (line.text.starts_with('[')) {
      if (in_grid) error("'}' is missing before the next symbol");
      symbol = upper(trim(line.text.substr(1, line.text.find(']') - 1)));
      in_grid = false;
      continue;
    }
    if (in_grid) {
      if (line.text.starts_with('}')) {
        in_grid = false;
        continue;
      }
      const auto words = words_of(line.text);
      if (words.size() != 2) {
        error("expected a position and a value");
        continue;
      }
      const auto position = number_of(words[0], file, line.number, diagnostics);
      const auto value = number_of(words[1], file, line.number, diagnostics);
      if (!position || !value) continue;
      ErrorTable& table = out.errors.back();
      const double at = *position * position_factor(machine.axes[*machine.axis(table.arguments[0])]);
      if (!table.nodes[0].empty() && at <= table.nodes[0].back()) error("positions must ascend");
      table.nodes[0].push_back(at);
      table.components[0].values.push_back(sign * *value);
      continue;
    }
    const auto equals = line.text.find('=');
    const std::string key = upper(trim(line.text.substr(0, equals)));
    if (equals == std::string_view::npos || symbol.empty()) {
      error("expected [symbol], VALUE = or Gridpoints = {");
    } else if (key == "VALUE") {
      if (const auto value = number_of(trim(line.text.substr(equals + 1)), file, line.number, diagnostics))
        out.location.emplace_back(symbol, sign * *value);
    } else if (key == "GRIDPOINTS") {
      if (!place_of_component(machine, symbol)) {
        error("'" + symbol + "' is no component error of this machine");
        return tl::unexpected(diagnostics.first_error());
      }
      ErrorTable table;
      table.file = file;
      table.arguments = {symbol.substr(2)};
      table.nodes.emplace_back();
      table.components.push_back({symbol, {}});
      out.errors.push_back(std::move(table));
      in_grid = true;
    } else {
      error("unknown key '" + key + "'");
    }
  }
  if (in_grid) diagnostics.error(file, {}, "'}' is missing at the end");
  for (const ErrorTable& table : out.errors)
    if (table.nodes[0].size() < 2)
      diagnostics.error(file, {}, table.components[0].name + " has fewer than two grid points");
  if (out.errors.empty() && out.location.empty() && diagnostics.error_count() == before)
    diagnostics.error(file, {1, 1}, "no error parameters");
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  return out;
}

Result<std::string> write_etalon(const ControlTables& tables, const Machine& machine,
                                 const FormatOptions& options) {
  const double sign = options.negate ? -1.0 : 1.0;
  std::string out;
  for (const auto& [name, value] : tables.location)
    out += "[" + name + "]\nVALUE = " + shortest_text(sign * value) + "\n";
  for (const ErrorTable& table : tables.errors) {
    if (table.arguments.size() != 1)
      return refuse("this format holds errors over one axis; " + table.components[0].name + " is over " +
                    table.arguments[0] + " and " + table.arguments[1] + " (the isg format takes it)");
    const double factor = position_factor(machine.axes[*machine.axis(table.arguments[0])]);
    for (const auto& component : table.components) {
      if (component.name.substr(2) != table.arguments[0])
        return refuse("this format holds errors over their own axis; " + component.name + " is over " +
                      table.arguments[0]);
      out += "[" + component.name + "]\nGridpoints = {\n";
      for (std::size_t i = 0; i < table.nodes[0].size(); ++i)
        out += shortest_text(table.nodes[0][i] / factor) + " " + shortest_text(sign * component.values[i]) +
               "\n";
      out += "}\n";
    }
  }
  return out;
}

}  // namespace

TableFormat etalon_format() {
  return {"etalon", "Etalon exchange file: error parameters over their own axis", false, read_etalon,
          write_etalon};
}

}  // namespace trunnion::formats
