#include "trunnion/machine/new_machine.hpp"

#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion {
namespace {

// 15 digits: those that a person gave.
std::string number(double value) {
  const double rounded = std::round(value * 1e9) / 1e9;
  return shortest_text(rounded == 0.0 ? 0.0 : rounded);
}

std::string vector(const Vec3& v) {
  return "[" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + "]";
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) >= ' ' && c != '\x7f') out += c;
  }
  return out + "\"";
}

// Along X, Y, Z: of A, B, C and of U, V, W too.
std::string direction(char letter, int sign) {
  const auto along = std::string_view(letter <= 'C' ? "ABC" : "XYZ").find(letter);
  std::string out;
  for (std::size_t i = 0; i < 3; ++i) out += (i == 0 ? "[" : ", ") + std::to_string(i == along ? sign : 0);
  return out + "]";
}

std::string axis_text(const NewMachine& machine, char letter) {
  const bool rotary = letter <= 'C';
  const double unit = rotary ? kRadPerDegree : 1.0;
  const std::string name(1, letter);
  std::string out =
      "\n[[axis]]\nname = \"" + name + "\"\ntype = \"" + (rotary ? "rotary" : "linear") + "\"\n";
  const int sign = rotary && !machine.table_turns_positively ? -1 : 1;
  out += "direction = " + direction(letter, sign);
  if (rotary) {
    out += "   # the table turns " + std::string(sign > 0 ? "positively" : "negatively") + " about " +
           "XYZ"[letter - 'A'] + " for a positive command\n";
    const auto point = machine.points_mm.find(letter);
    const Vec3 p = point == machine.points_mm.end() ? Vec3::Zero() : point->second;
    out += "point_mm = " + vector(p);
  }
  out += "\n";
  const auto travel = machine.travel.find(letter);
  const std::string suffix = rotary ? "_deg" : "_mm";
  if (travel != machine.travel.end() && travel->second.cyclic) {
    out += "cyclic = true\n";
  } else if (travel != machine.travel.end()) {
    out += "min" + suffix + " = " + number(travel->second.min / unit) + "\n";
    out += "max" + suffix + " = " + number(travel->second.max / unit) + "\n";
  }
  const auto rapid = machine.rapid.find(letter);
  if (rapid != machine.rapid.end())
    out += "rapid" + suffix + "_min = " + number(rapid->second / unit * kSecondsPerMinute) + "\n";
  const auto acceleration = machine.acceleration.find(letter);
  if (acceleration != machine.acceleration.end())
    out += "acceleration" + suffix + "_s2 = " + number(acceleration->second / unit) + "\n";
  const auto jerk = machine.jerk.find(letter);
  if (jerk != machine.jerk.end()) out += "jerk" + suffix + "_s3 = " + number(jerk->second / unit) + "\n";
  return out;
}

std::string comment(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at <= text.size();) {
    const auto end = std::min(text.find('\n', at), text.size());
    out += "# " + text.substr(at, end - at) + "\n";
    at = end + 1;
  }
  return out;
}

}  // namespace

std::string machine_file_text(const NewMachine& machine, const std::string& source) {
  std::string out = comment(source);
  out +=
      "# Positions are those of the spindle's gauge point, tool taken out, in machine coordinates. `trunnion "
      "machine` says what this file\n"
      "# means and writes a program that proves it: run that before the first part.\n";
  out += "[machine]\nname = " + quoted(machine.name) + "\n";
  if (machine.controller) out += "controller = " + quoted(*machine.controller) + "\n";
  if (machine.switchable_kinematics)
    out +=
        "switchable_kinematics = true   # the control switches between kinematics with tool-centre-point "
        "control and without\n";
  if (machine.tool_length_mm > 0.0)
    out += "\n[tool]\nlength_mm = " + number(machine.tool_length_mm) +
           "   # of tools to which nobody else gives a gauge length\n";
  const auto inner = machine.points_mm.find(machine.rotary.empty() ? ' ' : machine.rotary.back());
  const Vec3 zero =
      machine.part_zero_mm.value_or(inner == machine.points_mm.end() ? Vec3::Zero() : inner->second);
  out += "\n[part]\nzero_mm = " + vector(zero) + "   # the CL file's zero in the machine, rotary axes at 0\n";
  for (const char letter : std::string("XYZ") + machine.rotary) out += axis_text(machine, letter);
  out += "\n[chain]   # from the bed outwards\ntool = [\"X\", \"Y\", \"Z\"]\npart = [";
  for (std::size_t i = 0; i < machine.rotary.size(); ++i)
    out += std::string(i > 0 ? ", " : "") + "\"" + machine.rotary[i] + "\"";
  return out + "]\n";
}

}  // namespace trunnion
