#include "diagnosis/data/measurement_columns.hpp"

#include <map>

namespace trunnion::diagnosis {
namespace {

bool take_sensor(const std::string& name, std::size_t index, MeasurementColumns& columns) {
  constexpr std::string_view kTemperature = "_degC";
  if (name.starts_with("T_") && name.ends_with(kTemperature) && name.size() > 2 + kTemperature.size()) {
    columns.temperatures.push_back({name.substr(2, name.size() - 2 - kTemperature.size()), index});
    return true;
  }
  if (name.starts_with("s_") && name.size() > 2) {
    columns.states.push_back({name.substr(2), index});
    return true;
  }
  return false;
}

}  // namespace

std::string position_column(const Axis& axis) {
  return axis.name + (axis.kind == AxisKind::linear ? "_mm" : "_deg");
}
std::string direction_column(const Axis& axis) {
  return "dir_" + axis.name;
}
std::string velocity_column(const Axis& axis) {
  return "vel_" + axis.name + (axis.kind == AxisKind::linear ? "_mm_min" : "_deg_min");
}

MeasurementColumns measurement_columns(const config::CsvTable& table, const Machine& machine,
                                       Diagnostics& diagnostics) {
  MeasurementColumns columns;
  columns.axes.resize(machine.axes.size());
  std::map<std::string, std::optional<std::size_t>*> known = {
      {"run_id", &columns.run_id},     {"time_s", &columns.time},       {"spindle_rpm", &columns.rpm},
      {"quantity", &columns.quantity}, {"frame", &columns.frame},       {"value", &columns.value},
      {"unit", &columns.unit},         {"u_random", &columns.u_random}, {"u_common", &columns.u_common},
      {"n_x", &columns.n[0]},          {"n_y", &columns.n[1]},          {"n_z", &columns.n[2]},
      {"tool_x_mm", &columns.tool[0]}, {"tool_y_mm", &columns.tool[1]}, {"tool_z_mm", &columns.tool[2]}};
  std::vector<std::string> required = {"run_id", "quantity", "n_x",  "n_y",
                                       "n_z",    "value",    "unit", "u_random"};
  for (std::size_t a = 0; a < machine.axes.size(); ++a) {
    known[position_column(machine.axes[a])] = &columns.axes[a].position;
    known[direction_column(machine.axes[a])] = &columns.axes[a].direction;
    known[velocity_column(machine.axes[a])] = &columns.axes[a].velocity;
    required.push_back(position_column(machine.axes[a]));
  }
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const std::string& name = table.columns[i];
    if (const auto it = known.find(name); it != known.end())
      *it->second = i;
    else if (!take_sensor(name, i, columns))
      diagnostics.error(
          table.file, {table.header_line, static_cast<std::uint32_t>(i + 1)},
          "column '" + name + "' is not one of a measurement file of machine '" + machine.name + "'");
  }
  for (const std::string& name : required)
    if (!*known[name])
      diagnostics.error(table.file, {table.header_line, 1}, "column '" + name + "' is missing");
  return columns;
}

}  // namespace trunnion::diagnosis
