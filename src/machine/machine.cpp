#include "trunnion/machine/machine.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/config/section.hpp"
#include "trunnion/geom/direction.hpp"

#include "machine/body_keys.hpp"
#include "machine/safe_height_keys.hpp"

namespace trunnion {
namespace {

using config::Section;

constexpr std::string_view kAxisNames = "XYZABCUVW";

void read_limits(Section& s, Axis& axis, const char* min_key, const char* max_key) {
  const std::size_t errors = s.diagnostics().error_count();
  const auto min = s.find_quantity(min_key);
  const auto max = s.find_quantity(max_key);
  if (min.has_value() != max.has_value()) {
    const char* given = min ? min_key : max_key;
    const char* missing = min ? max_key : min_key;
    // A limit that is no number (-inf, a text) has had its message already.
    if (s.diagnostics().error_count() == errors)
      s.error(given, "'" + std::string(given) + "' is given without '" + missing + "'");
    return;
  }
  if (!min) {
    if (!axis.cyclic)
      s.error(min_key, "axis " + axis.name + " needs '" + min_key + "' and '" + max_key + "'" +
                           (axis.kind == AxisKind::rotary ? " or 'cyclic = true'" : ""));
    return;
  }
  if (*min >= *max) s.error(min_key, "'" + std::string(min_key) + "' must be below '" + max_key + "'");
  // A kilometre, and a million degrees: what is beyond them is no travel, and counts of steps are made of it.
  const bool rotary = axis.kind == AxisKind::rotary;
  const double largest = rotary ? 1e6 * kRadPerDegree : 1e6;
  if (std::max(std::abs(*min), std::abs(*max)) > largest)
    s.error(min_key, "'" + std::string(min_key) + "' and '" + max_key + "' must be within 1e6 " +
                         (rotary ? "deg" : "mm") + " of 0");
  axis.min = *min;
  axis.max = *max;
}

Vec3 read_direction(Section& s) {
  const std::size_t errors = s.diagnostics().error_count();
  const Vec3 v = s.vector("direction");
  if (s.diagnostics().error_count() > errors) return Vec3::UnitX();
  if (const auto direction = Direction::from(v)) return direction->vec();
  s.error("direction", "'direction' must be a unit vector; its length is " + shortest_text(v.norm()));
  return Vec3::UnitX();
}

void read_positive(Section& s, const char* key, std::optional<double>& out) {
  out = s.find_quantity(key);
  if (out && *out <= 0.0) s.error(key, "'" + std::string(key) + "' must be above 0");
}

Axis read_axis(Section& s) {
  Axis axis;
  axis.name = s.text("name");
  const bool known_name = axis.name.size() == 1 && kAxisNames.find(axis.name[0]) != std::string_view::npos;
  if (!axis.name.empty() && !known_name) {
    s.error("name", "axis name '" + axis.name + "' is none of X Y Z A B C U V W");
  }
  s.takes("name", {"X", "Y", "Z", "A", "B", "C", "U", "V", "W"});
  s.takes("type", {"linear", "rotary"});
  const std::string type = s.text("type");
  if (type != "linear" && type != "rotary" && !type.empty()) {
    s.error("type", "axis type '" + type + "' is neither \"linear\" nor \"rotary\"");
  }
  axis.kind = type == "rotary" ? AxisKind::rotary : AxisKind::linear;
  axis.direction = read_direction(s);
  if (axis.kind == AxisKind::rotary) {
    axis.point_mm = s.vector("point_mm");
    axis.cyclic = s.flag_or("cyclic", false);
    read_limits(s, axis, "min_deg", "max_deg");
    read_positive(s, "rapid_deg_min", axis.rapid);
    read_positive(s, "max_feed_deg_min", axis.max_feed);
    read_positive(s, "acceleration_deg_s2", axis.acceleration);
    read_positive(s, "jerk_deg_s3", axis.jerk);
  } else {
    axis.point_mm = s.find_vector("point_mm").value_or(Vec3::Zero());
    read_limits(s, axis, "min_mm", "max_mm");
    read_positive(s, "rapid_mm_min", axis.rapid);
    read_positive(s, "max_feed_mm_min", axis.max_feed);
    read_positive(s, "acceleration_mm_s2", axis.acceleration);
    read_positive(s, "jerk_mm_s3", axis.jerk);
    read_positive(s, "screw_pitch_mm", axis.screw_pitch_mm);
    constexpr double kFinestPitch_mm = 0.01;
    if (axis.screw_pitch_mm && *axis.screw_pitch_mm < kFinestPitch_mm)
      s.error("screw_pitch_mm", "'screw_pitch_mm' must be at least 0.01");
  }
  s.finish();
  return axis;
}

void read_chain(Section& s, const char* key, Machine& machine, std::vector<AxisId>& chain,
                std::vector<int>& uses) {
  for (const std::string& name : s.texts(key)) {
    const auto id = machine.axis(name);
    if (!id) {
      s.error(key, "'" + std::string(key) + "' names axis '" + name + "', which has no [[axis]]");
      continue;
    }
    ++uses[*id];
    chain.push_back(*id);
    machine.axes[*id].carries_part = std::string_view(key) == "part";
  }
}

void check_uses(Section& s, const Machine& machine, const std::vector<int>& uses) {
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (uses[id] == 1) continue;
    s.error("", "axis " + machine.axes[id].name +
                    " must stand in exactly one of 'tool' and 'part'; it stands in " +
                    std::to_string(uses[id]));
  }
}

void check_chain(Section& s, const Machine& machine) {
  for (const AxisId id : machine.tool_chain) {
    if (machine.axes[id].kind == AxisKind::rotary) {
      s.error("tool", "rotary axis " + machine.axes[id].name +
                          " carries the tool: only axes that carry the part may turn");
    }
  }
  const auto rotary = machine.rotary_axes();
  if (rotary.size() > 2)
    s.error("part", std::to_string(rotary.size()) + " rotary axes carry the part; at most 2 can");
  constexpr double kParallel = 1e-3;  // |n1 x n2| below which two rotary axes cannot tilt the part
  if (rotary.size() == 2 &&
      machine.axes[rotary[0]].direction.cross(machine.axes[rotary[1]].direction).norm() < kParallel) {
    s.error("part", "rotary axes " + machine.axes[rotary[0]].name + " and " + machine.axes[rotary[1]].name +
                        " are parallel");
  }
  Mat3 linear = Mat3::Zero();
  Eigen::Index count = 0;
  for (const Axis& axis : machine.axes) {
    if (axis.kind == AxisKind::linear && count < 3) linear.col(count) = axis.direction;
    if (axis.kind == AxisKind::linear) ++count;
  }
  if (count != 3) s.error("", "there must be three linear axes; there are " + std::to_string(count));
  constexpr double kFlat = 1e-3;
  if (count == 3 && std::abs(linear.determinant()) < kFlat)
    s.error("", "the three linear axes lie in one plane");
}

void read_axes(Section& root, Machine& machine) {
  auto sections = root.sections("axis");
  if (sections.empty()) root.error("axis", "no [[axis]] given");
  for (auto& s : sections) {
    Axis axis = read_axis(s);
    if (machine.axis(axis.name)) s.error("name", "axis '" + axis.name + "' is given twice");
    if (machine.axes.size() == kMaxAxes) {
      s.error("name", "more than " + std::to_string(kMaxAxes) +
                          " axes: three linear and at most two rotary ones can be");
      break;
    }
    machine.axes.push_back(std::move(axis));
  }
}

void read_chains(Section& root, Machine& machine) {
  auto s = root.find_section("chain");
  if (!s) {
    root.error("chain", "missing table [chain]");
    return;
  }
  const std::size_t errors = s->diagnostics().error_count();
  std::vector<int> uses(machine.axes.size(), 0);
  read_chain(*s, "tool", machine, machine.tool_chain, uses);
  read_chain(*s, "part", machine, machine.part_chain, uses);
  s->finish();
  if (s->diagnostics().error_count() > errors) return;
  check_uses(*s, machine, uses);
  check_chain(*s, machine);
}

constexpr std::int64_t kMostWorkOffsets = 1000;  // more than any control has

void read_output(Section& root, Machine& machine) {
  auto s = root.find_section("output");
  if (!s) return;
  s->takes("point", {"tip", "spindle"});
  const std::string point = s->find_text("point").value_or("tip");
  if (point != "tip" && point != "spindle")
    s->error("point", "'point' must be \"tip\" or \"spindle\", not \"" + point + "\"");
  machine.output_point = point == "spindle" ? OutputPoint::spindle : OutputPoint::tip;
  machine.work_offset_mm = s->find_vector("work_offset_mm").value_or(Vec3::Zero());
  machine.work_offset = s->find_integer("work_offset").value_or(1);
  if (machine.work_offset < 1 || machine.work_offset > kMostWorkOffsets) {
    s->error("work_offset", "'work_offset' must be 1 (G54), 2, ... up to " +
                                std::to_string(kMostWorkOffsets) + ", not " +
                                std::to_string(machine.work_offset));
  }
  s->finish();
}

void read_datum(Section& root, Machine& machine) {
  auto s = root.find_section("datum");
  if (!s) return;
  const auto* value = s->raw("probed_at", config::KeyType::text);
  if (value != nullptr && value->as_table() != nullptr) {
    auto pose = s->find_section("probed_at");
    JointVector q;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const Axis& axis = machine.axes[id];
      q[id] = pose->quantity_or(axis.name + (axis.kind == AxisKind::rotary ? "_deg" : "_mm"), 0.0);
    }
    pose->finish();
    machine.probed_at = q;
  } else if (const auto text = s->find_text("probed_at"); text && *text != "none") {
    s->error("probed_at", "'probed_at' must be \"none\" or a table like { A_deg = 0, C_deg = 0 }");
  }
  s->finish();
}

void read_thermal(Section& root, Machine& machine) {
  auto s = root.find_section("thermal");
  if (!s) return;
  machine.reference_degC = s->quantity_or("reference_degC", machine.reference_degC);
  machine.sensors.ambient = s->find_text("ambient_sensor").value_or(machine.sensors.ambient);
  if (auto sensors = s->find_section("axis_sensors")) {
    for (const std::string& name : sensors->keys("^[XYZABCUVW]$")) {
      if (!machine.axis(name))
        sensors->error(name, "'axis_sensors' names axis '" + name + "', which has no [[axis]]");
      if (const auto sensor = sensors->find_text(name)) machine.sensors.axes[name] = *sensor;
    }
  }
  s->finish();
}

void read_head(Section& root, Machine& machine) {
  if (auto s = root.find_section("machine")) {
    machine.name = s->text("name");
    machine.controller = s->find_text("controller");
    s->takes("kinematics", {"table-table"});
    const std::string kinematics = s->find_text("kinematics").value_or("table-table");
    if (kinematics != "table-table") {
      s->error("kinematics",
               "kinematics '" + kinematics + "' is not known; rotary axes carry the part: \"table-table\"");
    }
    machine.switchable_kinematics = s->flag_or("switchable_kinematics", false);
    if (const auto tolerance = s->find_quantity("axis_tolerance_deg")) {
      if (*tolerance <= 0.0) s->error("axis_tolerance_deg", "'axis_tolerance_deg' must be above 0");
      machine.axis_tolerance = Angle::radians(*tolerance);
    }
    s->finish();
  } else {
    root.error("machine", "missing table [machine]");
  }
  if (auto s = root.find_section("tool")) {
    machine.tool_length_mm = s->quantity("length_mm");
    if (machine.tool_length_mm < 0.0) s->error("length_mm", "'length_mm' must not be negative");
    s->finish();
  }
  if (auto s = root.find_section("spindle")) {
    machine.spindle_max_rpm = s->find_number("max_rpm").value_or(0.0);
    if (s->has("max_rpm") && machine.spindle_max_rpm <= 0.0) s->error("max_rpm", "'max_rpm' must be above 0");
    s->finish();
  }
  if (auto s = root.find_section("part")) {
    machine.part_zero_mm = s->vector("zero_mm");
    read_part_extent(*s, machine);
    s->finish();
  }
}

}  // namespace

std::optional<AxisId> Machine::axis(std::string_view axis_name) const {
  const auto it = std::find_if(axes.begin(), axes.end(), [&](const Axis& a) { return a.name == axis_name; });
  return it == axes.end() ? std::nullopt : std::optional<AxisId>(it - axes.begin());
}

std::vector<AxisId> Machine::rotary_axes() const {
  std::vector<AxisId> out;
  for (const AxisId id : part_chain) {
    if (axes[id].kind == AxisKind::rotary) out.push_back(id);
  }
  return out;
}

Result<Machine> parse_machine(std::string_view toml, const std::string& file, Diagnostics& diagnostics) {
  const auto value = config::parse_toml(toml, file);
  if (!value) {
    diagnostics.error(file, value.error().where, value.error().message);
    return tl::unexpected(value.error());
  }
  const std::size_t errors = diagnostics.error_count();
  Machine machine;
  machine.file = file;
  Section root(*value, "file", file, diagnostics);
  read_head(root, machine);
  read_axes(root, machine);
  read_chains(root, machine);
  read_bodies(root, machine);  // checked here, read by those who draw (load_body_meshes)
  read_output(root, machine);
  read_safe_height(root, machine);
  read_datum(root, machine);
  read_thermal(root, machine);
  root.finish();
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  return machine;
}

Result<Machine> load_machine(const std::string& path, Diagnostics& diagnostics) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_machine(*text, path, diagnostics);
}

}  // namespace trunnion
