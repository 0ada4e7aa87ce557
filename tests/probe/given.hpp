#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "trunnion/probe/program.hpp"

#include "probe/hidden_machine.hpp"
#include "support/folders.hpp"

namespace trunnion::test {

/// A machine that ships with the program, LinuxCNC, and a ball 60 mm beside its C axis.
struct Given {
  explicit Given(const std::string& name, const std::string& controller = "linuxcnc") {
    const std::string folder = test::source_folder() + "/postconfigs/";
    Diagnostics diagnostics;
    machine = load_machine(folder + "machines/" + name + ".toml", diagnostics).value();
    control = nc::load_controller(folder + "controllers/" + controller + ".toml", diagnostics).value();
    control.tcp.unknown_at_start = control.tcp.switches_kinematics && machine.switchable_kinematics;
  }
  probe::ProgramOptions options() const {
    probe::ProgramOptions out;
    out.ball.place_P = {60.0, 40.0, 30.0};
    out.ball.radius_mm = 12.7;
    out.ball.stylus_radius_mm = 3.0;
    out.ball.stylus_length_mm = machine.tool_length_mm;
    out.ball.within_mm = 4.71;
    return out;
  }
  /// The machine as its file has it.
  HiddenMachine hidden(const probe::Ball& ball) const {
    const auto triple = [](const Vec3& v) { return Triple{v.x(), v.y(), v.z()}; };
    HiddenMachine out;
    const Axis& a = machine.axes[*machine.axis("A")];
    const Axis& c = machine.axes[*machine.axis("C")];
    out.a_direction = triple(a.direction);
    out.a_point = triple(a.point_mm);
    out.c_direction = triple(c.direction);
    out.c_point = triple(c.point_mm);
    out.ball = triple(ball.place_P + machine.part_zero_mm);
    out.reach_mm = ball.reach_mm();
    return out;
  }

  Machine machine;
  nc::Controller control;
};

}  // namespace trunnion::test
