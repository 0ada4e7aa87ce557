#include "report/axis_figures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/machine/table_kinematics.hpp"

#include "report/nc_figures.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

// Twice the rounding of angles to 4 decimals of a degree: nearer to the pole the words say nothing.
constexpr double kAtPole_rad = 2e-4 * kRadPerDegree;

double factor_of(const Axis& axis) {
  return axis.kind == AxisKind::rotary ? kDegreePerRad : 1.0;
}

Series marks(std::string name, int colour) {
  Series s;
  s.name = std::move(name);
  s.mark = Mark::points;
  s.colour = colour;
  return s;
}

Figure positions_figure(const Machine& machine, const post::VerifyReport& report, AxisKind kind) {
  const bool rotary = kind == AxisKind::rotary;
  XyPlot plot{{"path length", "mm"}, {"position", rotary ? "°" : "mm"}, {}, {}, {}, false};
  Series beyond = marks("beyond a limit", 7);
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  int number = 0;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const Axis& axis = machine.axes[id];
    if (axis.kind != kind) continue;
    Series s;
    s.name = axis.name;
    s.colour = number++;
    for (const auto& block : report.blocks) {
      const double value = block.q[id] * factor_of(axis);
      s.x.push_back(block.path_mm);
      s.y.push_back(value);
      low = std::min(low, value);
      high = std::max(high, value);
      if (axis.within_limits(block.q[id])) continue;
      beyond.x.push_back(block.path_mm);
      beyond.y.push_back(value);
    }
    plot.series.push_back(std::move(s));
  }
  // A limit far from what is travelled would flatten the lines; the table has it.
  const double room = 0.5 * std::max(high - low, 1e-3);
  for (const Axis& axis : machine.axes) {
    if (axis.kind != kind || !axis.has_limits()) continue;
    for (const auto& [name, value] : {std::pair{" min", axis.min}, std::pair{" max", axis.max}}) {
      const double at = value * factor_of(axis);
      if (at > low - room && at < high + room) plot.levels.push_back({axis.name + name, at});
    }
  }
  if (!beyond.x.empty()) plot.series.push_back(std::move(beyond));
  return {rotary ? "rotary-positions" : "linear-positions", rotary ? "Rotary axes" : "Linear axes",
          "Joint positions, rapids included; dashed: limits near the travel.", std::move(plot)};
}

Figure velocities_figure(const Machine& machine, const post::VerifyReport& report, AxisKind kind) {
  const bool rotary = kind == AxisKind::rotary;
  XyPlot plot{{"path length", "mm"}, {"velocity", rotary ? "°/min" : "mm/min"}, {}, {}, {}, false};
  int number = 0;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const Axis& axis = machine.axes[id];
    if (axis.kind != kind) continue;
    Series s;
    s.name = axis.name;
    s.colour = number++;
    for (std::size_t i = 1; i < report.blocks.size(); ++i) {
      const auto& block = report.blocks[i];
      const double minutes = block.seconds / kSecondsPerMinute;
      s.x.push_back(block.path_mm);
      s.y.push_back(block.rapid || minutes <= 0.0
                        ? kGap
                        : (block.q[id] - report.blocks[i - 1].q[id]) * factor_of(axis) / minutes);
    }
    plot.series.push_back(std::move(s));
  }
  return {rotary ? "rotary-velocities" : "linear-velocities",
          rotary ? "Velocities of the rotary axes" : "Velocities of the linear axes",
          "Mean axis speed of each feed block: its travel over its time by the F word; rapids are not shown.",
          std::move(plot)};
}

Figure pole_figure(const post::VerifyReport& report, const std::vector<PolePlace>& places) {
  XyPlot plot{{"path length", "mm"}, {"angle from the pole", "°"}, {}, {}, {}, false};
  Series line;
  line.name = "angle from the pole";
  line.colour = 0;
  Series changes = marks("branch change", 1);
  Series passages = marks("at the pole", 3);
  int branch = 0;
  bool at_pole = false;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double x = report.blocks[i].path_mm;
    const double y = places[i].distance_rad * kDegreePerRad;
    line.x.push_back(x);
    line.y.push_back(y);
    if (places[i].branch == 0) {
      if (!at_pole) passages.x.push_back(x), passages.y.push_back(y);  // the first block of a stay
      at_pole = true;
      continue;
    }
    at_pole = false;
    if (branch != 0 && places[i].branch != branch) changes.x.push_back(x), changes.y.push_back(y);
    branch = places[i].branch;
  }
  const std::string caption =
      "At 0° (pole) the inner rotary axis does not change the tool direction. Branch changes (from one of "
      "the two rotary solutions to the other): " +
      std::to_string(changes.x.size()) + "; intervals at the pole: " + std::to_string(passages.x.size()) +
      ".";
  plot.series.push_back(std::move(line));
  if (!changes.x.empty()) plot.series.push_back(std::move(changes));
  if (!passages.x.empty()) plot.series.push_back(std::move(passages));
  return {"pole", "Pole and branches", caption, std::move(plot)};
}

Table travel_table(const post::VerifyReport& report) {
  Table table;
  table.id = "travel";
  table.title = "Travel and limits";
  table.columns = {"axis", "unit", "smallest", "largest", "limit", "limit", "room left"};
  table.numeric = {false, false, true, true, true, true, true};
  for (const auto& [axis, smallest, largest] : report.travel) {
    const auto text = [factor = factor_of(axis)](double value) { return fixed_text(value * factor, 3); };
    const bool limits = axis.has_limits();
    table.rows.push_back({axis.name, axis.kind == AxisKind::rotary ? "°" : "mm", text(smallest),
                          text(largest), limits ? text(axis.min) : "none", limits ? text(axis.max) : "none",
                          limits ? text(std::min(smallest - axis.min, axis.max - largest)) : ""});
  }
  return table;
}

}  // namespace

std::vector<PolePlace> pole_places(const Machine& machine, const post::VerifyReport& report) {
  std::vector<PolePlace> out;
  const TableKinematics kinematics(machine, machine.tool_vector());
  if (kinematics.rotary_count() != 2) return out;
  const Vec3 across = kinematics.direction(0).cross(kinematics.direction(1));
  const double most = across.norm();  // of the sine: 1 where the rotary axes are perpendicular
  out.reserve(report.blocks.size());
  for (const auto& block : report.blocks) {
    const auto sines = kinematics.sines(block.q);
    const double sine = kinematics.turn_back(0, kinematics.spindle(), sines).dot(across) / most;
    PolePlace place;
    place.distance_rad = std::asin(std::min(1.0, std::abs(sine)));
    place.branch = place.distance_rad < kAtPole_rad ? 0 : sine > 0.0 ? 1 : -1;
    out.push_back(place);
  }
  return out;
}

Section axes_section(const Machine& machine, const post::VerifyReport& report) {
  Section out{"Axes", {}};
  const bool rotary = !machine.rotary_axes().empty();
  if (rotary) out.items.emplace_back(positions_figure(machine, report, AxisKind::rotary));
  out.items.emplace_back(positions_figure(machine, report, AxisKind::linear));
  if (rotary) out.items.emplace_back(velocities_figure(machine, report, AxisKind::rotary));
  out.items.emplace_back(velocities_figure(machine, report, AxisKind::linear));
  if (const auto places = pole_places(machine, report); !places.empty())
    out.items.emplace_back(pole_figure(report, places));
  out.items.emplace_back(travel_table(report));
  return out;
}

}  // namespace trunnion::report
