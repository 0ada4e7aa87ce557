#include "effects/formats/format_support.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion {
namespace formats {

std::vector<Line> lines_of(std::string_view text) {
  std::vector<Line> out;
  for (std::uint32_t number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    out.push_back({trim(text.substr(0, end)), number});
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return out;
}

std::vector<std::string_view> words_of(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> out;
  while (true) {
    const auto begin = text.find_first_not_of(separators);
    if (begin == std::string_view::npos) return out;
    text.remove_prefix(begin);
    const auto end = text.find_first_of(separators);
    out.push_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end);
  }
}

std::optional<double> number_of(std::string_view word, const std::string& file, std::uint32_t line,
                                Diagnostics& diagnostics) {
  const ParsedNumber number = parse_number(word);
  if (number) return number.value;
  diagnostics.error(file, {line, 1}, "'" + std::string(word) + "' is not a number");
  return std::nullopt;
}

bool is_rotary(const Machine& machine, std::string_view axis) {
  const auto id = machine.axis(axis);
  return id && machine.axes[*id].kind == AxisKind::rotary;
}

std::vector<std::string> axis_numbers(const Machine& machine, const FormatOptions& options) {
  if (!options.axis_numbers.empty()) return options.axis_numbers;
  std::vector<std::string> out;
  for (const Axis& axis : machine.axes) out.push_back(axis.name);
  return out;
}

std::optional<std::size_t> number_of_axis(const Machine& machine, const FormatOptions& options,
                                          std::string_view axis) {
  const auto names = axis_numbers(machine, options);
  const auto it = std::find(names.begin(), names.end(), axis);
  if (it == names.end()) return std::nullopt;
  return static_cast<std::size_t>(it - names.begin()) + 1;
}

Result<double> equal_step(const std::vector<double>& nodes, const std::string& what) {
  const double step = (nodes.back() - nodes.front()) / static_cast<double>(nodes.size() - 1);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (std::abs(nodes[i] - nodes.front() - static_cast<double>(i) * step) > 1e-6 * step)
      return refuse(what + " wants equal steps; node " + std::to_string(i + 1) + " is off (give --step)");
  return step;
}

std::string plain(double value) {
  std::string text = fixed_text(value, 9);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text;
}

}  // namespace formats

std::size_t CorrectionMap::size() const {
  return nodes[0].size() * (nodes.size() > 1 ? nodes[1].size() : 1);
}

const CorrectionMap::Output* CorrectionMap::output(std::string_view axis) const {
  const auto it =
      std::find_if(outputs.begin(), outputs.end(), [&](const Output& o) { return o.axis == axis; });
  return it == outputs.end() ? nullptr : &*it;
}

double CorrectionMap::value(const std::vector<double>& values, double u, double v) const {
  const auto locate = [](const std::vector<double>& x, double at) {
    at = std::clamp(at, x.front(), x.back());
    const auto upper = std::upper_bound(x.begin() + 1, x.end() - 1, at);
    const auto i = static_cast<std::size_t>(upper - x.begin()) - 1;
    return std::pair(i, (at - x[i]) / (x[i + 1] - x[i]));
  };
  const auto [i, s] = locate(nodes[0], u);
  if (nodes.size() == 1) return values[i] + s * (values[i + 1] - values[i]);
  const auto second = locate(nodes[1], v);
  const std::size_t width = nodes[1].size();
  const auto row = [&](std::size_t r) {
    const auto [j, t] = second;
    return values[r * width + j] + t * (values[r * width + j + 1] - values[r * width + j]);
  };
  return row(i) + s * (row(i + 1) - row(i));
}

namespace {

// What every user of a table takes for granted: at least two nodes that rise, and numbers.
Result<void> rising(const std::vector<double>& nodes, const std::string& input, const std::string& file) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!std::isfinite(nodes[i]) || (i > 0 && nodes[i] <= nodes[i - 1]))
      return fail(ErrorCode::wrong_input,
                  "positions over " + input + " must rise: number " + std::to_string(i + 1) + " does not",
                  file);
  }
  if (nodes.size() < 2)
    return fail(ErrorCode::wrong_input, "a table over " + input + " with fewer than two positions", file);
  return {};
}

Result<ControlTables> sound(ControlTables tables, const std::string& file) {
  const auto numbers = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  };
  for (const CorrectionMap& map : tables.corrections) {
    for (std::size_t k = 0; k < map.inputs.size(); ++k) {
      if (auto ok = rising(map.nodes[k], map.inputs[k], file); !ok) return tl::unexpected(ok.error());
    }
    for (const CorrectionMap::Output& output : map.outputs) {
      if (!numbers(output.up) || !numbers(output.down))
        return fail(ErrorCode::wrong_input, "a correction of " + output.axis + " is beyond all numbers",
                    file);
    }
  }
  return tables;
}

TableFormat with_sound_tables(TableFormat format) {
  format.read = [read = std::move(format.read)](std::string_view text, const std::string& file,
                                                const Machine& machine, const FormatOptions& options,
                                                Diagnostics& diagnostics) -> Result<ControlTables> {
    auto out = read(text, file, machine, options, diagnostics);
    return out ? sound(std::move(*out), file) : out;
  };
  return format;
}

}  // namespace

const std::vector<TableFormat>& table_formats() {
  using namespace formats;
  static const std::vector<TableFormat> all = [] {
    std::vector<TableFormat> out{isg_format(),        etalon_format(), siemens_format(), linuxcnc_format(),
                                 heidenhain_format(), fanuc_format(),  aerotech_format()};
    for (TableFormat& format : out) format = with_sound_tables(std::move(format));
    return out;
  }();
  return all;
}

const TableFormat* table_format(std::string_view name) {
  for (const TableFormat& format : table_formats())
    if (format.name == name) return &format;
  return nullptr;
}

}  // namespace trunnion
