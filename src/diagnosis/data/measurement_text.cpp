#include <array>
#include <charconv>

#include "trunnion/base/printable.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/measurement.hpp"

#include "diagnosis/data/measurement_columns.hpp"

namespace trunnion::diagnosis {
namespace {

// Ten significant digits: 1e-4 nm of a millimetre reading, without the noise of unit conversions.
std::string number(double value) {
  std::array<char, 40> buffer;
  const auto r = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value == 0.0 ? 0.0 : value,
                               std::chars_format::general, 10);
  return {buffer.data(), r.ptr};
}

std::string header(const Dataset& data, const Machine& machine) {
  std::string out = "run_id,time_s";
  for (const Axis& axis : machine.axes) out += "," + position_column(axis);
  for (const Axis& axis : machine.axes) out += "," + direction_column(axis);
  for (const Axis& axis : machine.axes) out += "," + velocity_column(axis);
  out += ",spindle_rpm";
  for (const auto& name : data.context.names.temperatures) out += ",T_" + name + "_degC";
  for (const auto& name : data.context.names.states) out += ",s_" + name;
  return out + ",tool_x_mm,tool_y_mm,tool_z_mm,quantity,n_x,n_y,n_z,frame,value,unit,u_random,u_common\n";
}

std::string state_fields(const Dataset& data, const Machine& machine, std::size_t row) {
  const MachineState state = data.track.state(row);
  const auto unit = [&](std::size_t a) {
    return machine.axes[a].kind == AxisKind::linear ? 1.0 : kDegreePerRad;
  };
  std::string out = config::csv_field(data.context.runs[state.run].id) + "," + number(state.time_s);
  for (std::size_t a = 0; a < machine.axes.size(); ++a) out += "," + number(state.q[a] * unit(a));
  for (std::size_t a = 0; a < machine.axes.size(); ++a) out += "," + std::to_string(state.direction[a]);
  for (std::size_t a = 0; a < machine.axes.size(); ++a)
    out += "," + number(state.velocity[a] * unit(a) * kSecondsPerMinute);
  out += "," + number(state.spindle_rpm);
  for (std::size_t i = 0; i < data.context.names.temperatures.size(); ++i)
    out += "," + number(state.temperature(i) + machine.reference_degC);
  for (std::size_t i = 0; i < data.context.names.states.size(); ++i) out += "," + number(state.free_state(i));
  for (int i = 0; i < 3; ++i) out += "," + number(data.rows[row].tool_mm[i]);
  return out;
}

std::string reading_fields(const Reading& reading) {
  const bool displacement = reading.quantity == Quantity::displacement;
  const double factor = displacement ? kMmPerUm : kRadPerUrad;
  std::string out = displacement ? ",displacement" : ",rotation";
  for (int i = 0; i < 3; ++i) out += "," + number(reading.n[i]);
  out += reading.frame == SensitivityFrame::part ? ",part," : ",machine,";
  out += number(reading.value / factor) + (displacement ? ",um," : ",urad,") +
         number(reading.u_random / factor) + ",";
  return reading.u_common ? out + number(*reading.u_common / factor) : out;
}

}  // namespace

std::string measurements_text(const Dataset& data, const Machine& machine,
                              const std::vector<std::string>& comments) {
  std::string out;
  for (const auto& comment : comments) out.append("# ").append(printable(comment, "\t")).append("\n");
  out += header(data, machine);
  std::vector<std::vector<std::size_t>> readings(data.rows.size());
  for (std::size_t i = 0; i < data.readings.size(); ++i) readings[data.readings[i].row].push_back(i);
  for (std::size_t row = 0; row < data.rows.size(); ++row) {
    const std::string state = state_fields(data, machine, row);
    if (readings[row].empty()) out += state + ",displacement,1,0,0,machine,,um,,\n";
    for (const std::size_t i : readings[row]) out += state + reading_fields(data.readings[i]) + "\n";
  }
  return out;
}

}  // namespace trunnion::diagnosis
