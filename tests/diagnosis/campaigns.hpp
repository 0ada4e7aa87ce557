#pragma once
#include <gtest/gtest.h>
#include <string>

#include "trunnion/diagnosis/diagnose.hpp"

#include "support/machines.hpp"

namespace trunnion::test {

/// A plan as a shop would measure: lasers, diagonals, angles, balls on the table; warm-up and feed runs on
/// demand.
struct Campaign {
  bool lasers = true, angles = true, table = true, thermal = false, feeds = false;
  double u_common_um = 0.3;
  std::string simulation;  // lines of [simulation]
};

inline std::string sweep_run(const std::string& id, const std::string& axis, double from, double to,
                             int points, const std::string& n, const std::string& quantity, const Campaign& c,
                             const std::string& more = "") {
  const std::string unit = axis == "A" || axis == "C" ? "_deg" : "_mm";
  return "[[run]]\nid = \"" + id + "\"\nminutes = 15\nquantity = \"" + quantity + "\"\nn = " + n +
         "\nu_random = 0.8\nu_common = " + std::to_string(c.u_common_um) + "\nboth_directions = true\n" +
         more + "sweep = { axis = \"" + axis + "\", from" + unit + " = " + std::to_string(from) + ", to" +
         unit + " = " + std::to_string(to) + ", points = " + std::to_string(points) + " }\n";
}

inline std::string plan_text(const Campaign& c) {
  const std::string all = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
  std::string out;
  if (c.lasers) {
    out += sweep_run("laser_x", "X", -250, 250, 31, "[1, 0, 0]", "displacement", c);
    out += sweep_run("laser_y", "Y", -250, 250, 31, "[0, 1, 0]", "displacement", c);
    out += sweep_run("laser_z", "Z", 0, 300, 31, "[0, 0, 1]", "displacement", c);
    out += sweep_run("straight_x", "X", -240, 240, 17, all, "displacement", c);
    out += sweep_run("straight_y", "Y", -240, 240, 17, all, "displacement", c,
                     "at = { X_mm = 120, Z_mm = 100 }\n");
    out +=
        sweep_run("straight_z", "Z", 0, 300, 17, all, "displacement", c, "at = { X_mm = -100, Y_mm = 80 }\n");
  }
  if (c.angles) {
    for (const auto& [axis, low, high] :
         {std::tuple{"X", -240, 240}, {"Y", -240, 240}, {"Z", 0, 300}, {"A", -25, 100}, {"C", 0, 350}})
      out += sweep_run(std::string("angle_") + axis, axis, low, high, 15, all, "rotation", c);
  }
  const std::string head = "minutes = 20\nquantity = \"displacement\"\nn = " + all +
                           "\nu_random = 0.8\nu_common = " + std::to_string(c.u_common_um) + "\n";
  if (c.table)
    for (const auto& [id, ball, tool] : {std::tuple{"ball_1", "[80, 0, 60]", "-150"},
                                         {"ball_2", "[0, 90, 120]", "-150"},
                                         {"ball_3", "[-70, -40, 40]", "-230"}})
      out += std::string("[[run]]\nid = \"") + id + "\"\n" + head + "tool_z_mm = " + tool +
             "\ngrid = { A_deg = [-20, 0, 25, 50, 80], C_deg = [0, 50, 100, 170, 240, 310] }\nball_mm = " +
             ball + "\n";
  if (c.thermal) {
    out += "[[run]]\nid = \"warm_up\"\n" + head +
           "spindle_rpm = [[0, 9000], [60, 0]]\nT_ambient_degC = [[0, 20], [50, 22], [120, 21]]\n" +
           "T_frame_degC = [[0, 20], [60, 26], [120, 23]]\nT_screw_x_degC = [[0, 21], [120, 21]]\nrepeat = "
           "40\nposes = [[0, 0, 100, 0, 0]]\n";
    out.replace(out.rfind("minutes = 20"), 12, "minutes = 120");
    out += "[[run]]\nid = \"room\"\n" + head +
           "T_ambient_degC = [[0, 20], [120, 24], [240, 21]]\nT_frame_degC = [[0, 20], [240, 21]]\n" +
           "T_screw_x_degC = [[0, 20], [240, 21]]\nrepeat = 20\nposes = [[0, 0, 100, 0, 0], [100, 50, 150, "
           "30, 60]]\n";
    out.replace(out.rfind("minutes = 20"), 12, "minutes = 240");
    out += sweep_run("laser_x_warm", "X", -250, 250, 31, "[1, 0, 0]", "displacement", c,
                     "T_screw_x_degC = [[0, 28], [15, 28]]\n");
  }
  if (c.feeds)
    for (const auto& [id, axis, low, high, feed] : {std::tuple{"fly_x_slow", "X", -200, 200, 1000},
                                                    {"fly_x_fast", "X", -200, 200, 8000},
                                                    {"fly_y_slow", "Y", -200, 200, 1000},
                                                    {"fly_y_fast", "Y", -200, 200, 8000}})
      out += sweep_run(id, axis, low, high, 21, std::string(axis) == "X" ? "[1, 0, 0]" : "[0, 1, 0]",
                       "displacement", c, "feed_mm_min = " + std::to_string(feed) + "\n");
  if (!c.simulation.empty()) out += "[simulation]\n" + c.simulation;
  return out;
}

inline Machine thermal_machine(const std::string& name) {
  Machine machine = shipped_machine(name);
  machine.sensors.axes["X"] = "screw_x";
  return machine;
}

/// Simulated readings of a plan on a machine whose truth is `truth` (TOML).
inline diagnosis::Dataset measured(const Machine& machine, const std::string& plan_toml,
                                   const std::string& truth, std::uint64_t seed) {
  Diagnostics diagnostics;
  const auto plan = diagnosis::parse_plan(plan_toml, "plan", machine, diagnostics);
  if (!plan) throw std::runtime_error(plan.error().text());
  auto data = diagnosis::expand(plan->runs, machine);
  if (!data) throw std::runtime_error(data.error().text());
  const auto model = parse_model(truth, "truth", machine, data->context, diagnostics);
  if (!model) throw std::runtime_error(model.error().text());
  diagnosis::simulate(*data, *plan, machine, *model, seed);
  return *data;
}

inline Model model_for(const Machine& machine, const diagnosis::Dataset& data, const std::string& toml) {
  Diagnostics diagnostics;
  const auto model = parse_model(toml, "model", machine, data.context, diagnostics);
  if (!model) throw std::runtime_error(model.error().text());
  return *model;
}

/// Beside the places of the axes, which are fitted.
inline diagnosis::Diagnosis said_beside_locations(const Machine& machine, const diagnosis::Dataset& data) {
  return diagnose(machine, data,
                  model_for(machine, data,
                            "[model]\nname = \"known\"\n[[effect]]\nid = \"location:A\"\n[[effect]]\nid "
                            "= \"location:C\"\n"));
}

}  // namespace trunnion::test
