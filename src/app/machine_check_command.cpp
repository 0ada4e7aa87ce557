#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <spdlog/fmt/fmt.h>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/iso841.hpp"
#include "trunnion/machine/motion_plan.hpp"
#include "trunnion/machine/reach.hpp"
#include "trunnion/post/tools.hpp"
#include "trunnion/report/command_pages.hpp"

#include "app/command_tree.hpp"
#include "app/options.hpp"

namespace trunnion::app {
namespace {

struct MachineCheckCommand {
  MachineOptions machine;
  ResultOptions result;
};

// What a file need not say, and what then is not known.
std::vector<std::string> left_open(const Machine& machine) {
  std::vector<std::string> out;
  for (const Axis& axis : machine.axes) {
    if (!axis.rapid)
      out.push_back("axis " + axis.name +
                    " has no rapid speed (rapid_mm_min, rapid_deg_min): feeds are not limited to its speed, "
                    "and machining times are only estimates");
  }
  const auto has_jerk = [](const Axis& axis) { return axis.jerk.has_value(); };
  const bool any = std::any_of(machine.axes.begin(), machine.axes.end(), has_jerk);
  if (any && !(MotionTime::is_known(machine) && MotionPlan::knows_jerk(machine)))
    out.emplace_back("the jerk of the axes is not used: not every axis has an acceleration and a jerk");
  if (machine.tool_length_mm <= 0.0)
    out.emplace_back("no [tool] length_mm: a tool file or the CL file must say how long each tool is");
  if (!machine.safe.table) out.emplace_back("no [table]: rapids are not checked against the table");
  if (!machine.safe.z_is_given)
    out.emplace_back("no [retract] z_mm: the tool retracts to the end of the travel of Z");
  return out;
}

// What is possible, and as a rule a mistake: a length in inches, two numbers in the wrong order.
std::vector<std::string> unusual(const Machine& machine, const MachineReach& reach) {
  std::vector<std::string> out;
  const double length = machine.tool_length_mm;
  if (length > 0.0 && length < post::kShortestGauge_mm)
    out.push_back("the gauge length " + shortest_text(length) +
                  " mm is shorter than tool holders are: is it in inches?");
  // The slowest machine that is known here moves at 1200 mm/min; nobody turns a table for a minute and more.
  constexpr double kSlowest_mm_s = 200.0 / 60.0, kSlowest_rad_s = kTwoPi / 60.0;
  // Small machines have 100 mm/s2 and 100 deg/s2, large ones up to 20 m/s2 and 30 rad/s2.
  constexpr double kLaziest_mm_s2 = 25.0, kLaziest_deg_s2 = 25.0;
  for (const Axis& axis : machine.axes) {
    const bool rotary = axis.kind == AxisKind::rotary;
    if (axis.rapid && *axis.rapid < (rotary ? kSlowest_rad_s : kSlowest_mm_s))
      out.push_back("the rapid speed of " + axis.name + ", " +
                    shortest_text(*axis.rapid * kSecondsPerMinute * (rotary ? kDegreePerRad : 1.0)) +
                    (rotary ? " deg/min, is less than a turn a minute: is it in 1/min?"
                            : " mm/min, is less than 200: is it in m/min?"));
    // The shortest travels of the machines in postconfigs/makers are 90 mm and 145 degrees.
    constexpr double kShortest_mm = 20.0, kShortest_deg = 10.0;
    if (const double travel = (axis.max - axis.min) * (rotary ? kDegreePerRad : 1.0);
        axis.has_limits() && travel < (rotary ? kShortest_deg : kShortest_mm))
      out.push_back("the travel of " + axis.name + ", " + shortest_text(std::round(1e3 * travel) / 1e3) +
                    (rotary ? " deg, is less than 10: is it in radians?"
                            : " mm, is less than 20: is it in metres or inches?"));
    if (rotary && axis.has_limits() && (axis.min > 0.0 || axis.max < 0.0))
      out.push_back("axis " + axis.name +
                    " cannot stand at 0 degrees: are the signs of its travel those of the control?");
    if (!axis.acceleration) continue;
    const double acceleration = *axis.acceleration * (rotary ? kDegreePerRad : 1.0);
    if (acceleration < (rotary ? kLaziest_deg_s2 : kLaziest_mm_s2))
      out.push_back("the acceleration of " + axis.name + ", " + shortest_text(acceleration) +
                    (rotary ? " deg/s2, is less than 25: is it in rad/s2?"
                            : " mm/s2, is less than 25: is it in m/s2?"));
    // Machines get to their acceleration in a hundredth of a second to a fifth.
    constexpr double kLongestRamp_s = 0.5;
    if (axis.jerk && *axis.acceleration > kLongestRamp_s * *axis.jerk)
      out.push_back(fmt::format(
          "with this jerk axis {} takes {} s to reach its acceleration, more than 0.5: is it in {}?",
          axis.name, shortest_text(std::round(1e3 * *axis.acceleration / *axis.jerk) / 1e3),
          rotary ? "rad/s3" : "m/s3"));
  }
  if (const auto z = machine.axis("Z"); z && machine.axes[*z].has_limits() && machine.safe.z_mm()) {
    const double above_middle = *machine.safe.z_mm() - 0.5 * (machine.axes[*z].min + machine.axes[*z].max);
    if ((machine.safe.away < 0 ? -above_middle : above_middle) < 0.0)
      out.push_back(
          "the safe height, Z " + shortest_text(*machine.safe.z_mm()) +
          " mm, is in the half of the travel of Z that is nearer to the table ([retract] z_mm): the "
          "tool would turn and be changed there");
  }
  for (std::string& doubt : directions_beside_iso841(machine)) out.push_back(std::move(doubt));
  constexpr Angle kAnyWay = Angle::degrees(1.0);
  if (machine.rotary_axes().size() == 2 && reach.every_way < kAnyWay && reach.one_way > kAnyWay)
    out.emplace_back(
        "the tool axis tilts in one plane only: is the tilting axis the first one in [chain] part (nearest "
        "to the bed)?");
  constexpr double kShare = 0.15;  // of the travel
  for (const AxisId id : machine.rotary_axes()) {
    const Axis& rotary = machine.axes[id];
    for (const Axis& linear : machine.axes) {
      if (linear.kind != AxisKind::linear || !linear.has_limits() || linear.name == "Z") continue;
      if (std::abs(linear.direction.dot(rotary.direction)) > 0.5)
        continue;  // the point may lie anywhere there
      const double middle = 0.5 * (linear.min + linear.max);
      const double beside = std::abs(rotary.point_mm.dot(linear.direction) - middle);
      if (beside > kShare * (linear.max - linear.min))
        out.push_back(
            fmt::format("axis {} is {:.0f} mm off the middle of the travel of {}: are the numbers of its "
                        "point in mm, and in the order X, Y, Z?",
                        rotary.name, beside, linear.name));
    }
  }
  return out;
}

std::string position_text(const Machine& machine, const JointVector& q) {
  std::string out;
  for (const AxisId id : machine.rotary_axes())
    out +=
        fmt::format("{}{} {:.0f} deg", out.empty() ? "" : ", ", machine.axes[id].name, q[id] * kDegreePerRad);
  return out;
}

ExitCode run(const MachineCheckCommand& command) {
  Diagnostics diagnostics;
  const auto files = load_with_controller(command.machine, diagnostics);
  if (!files) return print_failure(diagnostics, files.error());
  const Machine& machine = files->machine;
  const auto bodies = load_body_meshes(machine, diagnostics);  // a check looks at these files, too
  if (!bodies) return print_failure(diagnostics, bodies.error());
  print(diagnostics);
  const MachineReach reach = machine_reach(machine);
  std::vector<std::string> notes = left_open(machine);
  if (!machine.controller && command.machine.controller.empty())
    notes.push_back("no [machine] controller: programs are for " + files->controller.name +
                    " unless -c names another control");
  const std::vector<std::string> doubts = unusual(machine, reach);

  nlohmann::ordered_json json = {{"name", machine.name},
                                 {"controller", files->controller.name},
                                 {"tool_axis_every_way_deg", reach.every_way.deg()},
                                 {"tool_axis_one_way_deg", reach.one_way.deg()},
                                 {"beyond_travel_at_part_zero", nlohmann::ordered_json::array()},
                                 {"left_open", notes},
                                 {"unusual", doubts}};
  std::string text =
      machine.name + ": the file and its control (" + files->controller.name + ") can be read\n";
  const std::string every = fmt::format("{:.0f}", reach.every_way.deg());
  const std::string some = fmt::format("{:.0f}", reach.one_way.deg());
  text += "the tool axis reaches every direction up to " + every + " deg from the spindle" +
          (some == every ? "" : ", some up to " + some + " deg") + "\n";
  for (const auto& beyond : reach.beyond) {
    const Axis& axis = machine.axes[beyond.axis];
    text +=
        fmt::format("with the tip at the part's zero {} would go {:.1f} mm beyond its travel, most at {}\n",
                    axis.name, beyond.by_mm, position_text(machine, beyond.at));
    json["beyond_travel_at_part_zero"].push_back(
        {{"axis", axis.name}, {"by_mm", beyond.by_mm}, {"at", position_text(machine, beyond.at)}});
  }
  if (reach.beyond.empty())
    text += "with the tip at the part's zero every axis stays within its travel at all rotary positions\n";
  for (const std::string& doubt : doubts) text += "unusual: " + doubt + "\n";
  for (const std::string& note : notes) text += "left open: " + note + "\n";
  text += "`trunnion machine " + command.machine.machine +
          "` says which way each axis goes, and writes a program that proves it\n";
  return command.result.write(
      json.dump(),
      [&] {
        return report::machine_check_page(machine, *bodies,
                                          {machine.name + ": the machine file", {}, json.dump(), made_by()});
      },
      text);
}

}  // namespace

void add_machine_check_command(CLI::App& machine, int& exit) {
  auto command = std::make_shared<MachineCheckCommand>();
  CLI::App* c =
      machine.add_subcommand("check", "check a machine file: errors, reach of the machine, missing keys");
  c->add_option("machine", command->machine.machine,
                "machine file, or the name of one in postconfigs/machines")
      ->type_name(kMachineName)
      ->required();
  c->add_option(
       "-c,--controller", command->machine.controller,
       "controller file, or the name of one in postconfigs/controllers, that the machine is used with")
      ->type_name(kControllerName);
  command->result.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace trunnion::app
