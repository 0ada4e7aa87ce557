#include "trunnion/machine/new_machine.hpp"

#include <gtest/gtest.h>

#include "trunnion/base/units.hpp"
#include "trunnion/machine/reach.hpp"

#include "support/machines.hpp"

namespace trunnion {
namespace {

NewMachine ac_machine() {
  NewMachine m;
  m.name = "a \"quoted\" name";
  m.controller = "iso";
  m.rotary = "AC";
  m.table_turns_positively = false;
  m.points_mm = {{'A', {0.0, 0.4, -65.0}}, {'C', {0.1, 0.0, -30.0}}};
  m.travel = {{'X', {-500.0, 400.0, false}},
              {'Y', {-300.0, 300.0, false}},
              {'Z', {-400.0, 700.0, false}},
              {'A', {-30.0 * kRadPerDegree, 120.0 * kRadPerDegree, false}},
              {'C', {0.0, 0.0, true}}};
  m.rapid = {{'X', 600.0}, {'A', kPi}};
  m.tool_length_mm = 150.0;
  m.switchable_kinematics = true;
  return m;
}

// Read back, every figure is the one that was said.
TEST(NewMachine, ReadsBackAsItWasSaid) {
  Diagnostics diagnostics;
  const auto read = parse_machine(machine_file_text(ac_machine(), "two\nlines"), "new.toml", diagnostics);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->name, "a \"quoted\" name");
  EXPECT_EQ(read->controller, "iso");
  EXPECT_TRUE(read->switchable_kinematics);
  EXPECT_DOUBLE_EQ(read->tool_length_mm, 150.0);
  ASSERT_EQ(read->axes.size(), 5U);
  const Axis& a = read->axes[*read->axis("A")];
  EXPECT_EQ(a.direction, Vec3(-1, 0, 0));
  EXPECT_EQ(a.point_mm, Vec3(0, 0.4, -65));
  EXPECT_DOUBLE_EQ(a.min, -30.0 * kRadPerDegree);
  EXPECT_DOUBLE_EQ(a.max, 120.0 * kRadPerDegree);
  EXPECT_NEAR(*a.rapid, kPi, 1e-9);
  const Axis& c = read->axes[*read->axis("C")];
  EXPECT_TRUE(c.cyclic);
  EXPECT_FALSE(c.has_limits());
  const Axis& x = read->axes[*read->axis("X")];
  EXPECT_EQ(x.direction, Vec3(1, 0, 0));
  EXPECT_DOUBLE_EQ(x.max, 400.0);
  EXPECT_DOUBLE_EQ(*x.rapid, 600.0);
  EXPECT_FALSE(read->axes[*read->axis("Y")].rapid);
  EXPECT_EQ(read->part_zero_mm, Vec3(0.1, 0, -30));  // on the innermost axis where nobody says it
}

TEST(NewMachine, TheTableThatTurnsPositivelyHasTheOtherSign) {
  NewMachine m = ac_machine();
  m.table_turns_positively = true;
  m.rotary = "BC";
  m.points_mm = {{'B', Vec3::Zero()}, {'C', Vec3::Zero()}};
  m.travel['B'] = m.travel['A'];
  Diagnostics diagnostics;
  const auto read = parse_machine(machine_file_text(m, "x"), "new.toml", diagnostics);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->axes[*read->axis("B")].direction, Vec3(0, 1, 0));
  EXPECT_EQ(read->axes[*read->axis("C")].direction, Vec3(0, 0, 1));
}

constexpr const char* kIni = R"(# comment
[EMC]
MACHINE = mine
[KINS]
KINEMATICS = xyzac-trt-kins sparm=identityfirst
[HAL]
HALFILE = LIB:basic_sim.tcl
HALCMD = net :y xyzac-trt-kins.y-offset gui.y
HALCMD = sets :y 20
HALCMD = setp xyzac-trt-kins.x-rot-point 1.5
[TRAJ]
LINEAR_UNITS = inch
[AXIS_X]
MIN_LIMIT = -10
MAX_LIMIT = 10
MAX_VELOCITY = 2
[AXIS_Y]
MIN_LIMIT = -10
MAX_LIMIT = 10
[AXIS_Z]
MIN_LIMIT = -10
MAX_LIMIT = 10
[JOINT_3]
MIN_LIMIT = -100
MAX_LIMIT = 50
MAX_VELOCITY = 30
MAX_ACCELERATION = 45
MAX_JERK = 900
[AXIS_C]
MIN_LIMIT = -36000
MAX_LIMIT = 36000
)";

TEST(MachineOfIni, TakesPinsTravelsAndSpeeds) {
  Diagnostics diagnostics;
  const auto m = machine_of_ini(kIni, "mine.ini", diagnostics);
  ASSERT_TRUE(m) << m.error().text();
  EXPECT_EQ(m->name, "mine");
  EXPECT_EQ(m->rotary, "AC");
  EXPECT_NEAR((m->points_mm.at('C') - Vec3(1.5 * 25.4, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((m->points_mm.at('A') - Vec3(1.5 * 25.4, 20 * 25.4, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(m->travel.at('X').max, 254.0, 1e-12);
  EXPECT_NEAR(m->rapid.at('X'), 50.8, 1e-12);
  EXPECT_NEAR(m->travel.at('A').min, -100.0 * kRadPerDegree, 1e-12);  // of its joint, where no axis says it
  EXPECT_NEAR(m->rapid.at('A'), 30.0 * kRadPerDegree, 1e-12);
  EXPECT_FALSE(m->rapid.contains('Y'));
  EXPECT_NEAR(m->acceleration.at('A'), 45.0 * kRadPerDegree, 1e-12);
  EXPECT_FALSE(m->acceleration.contains('X'));
  const std::string text = machine_file_text(*m, "x");
  EXPECT_NE(text.find("acceleration_deg_s2 = 45\njerk_deg_s3 = 900"), std::string::npos) << text;
  const auto read = parse_machine(text, "mine.toml", diagnostics);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_NEAR(read->axes[3].jerk.value(), 900.0 * kRadPerDegree, 1e-12);
}

std::string message_of(std::string text, const std::string& old, const std::string& with) {
  text.replace(text.find(old), old.size(), with);
  Diagnostics diagnostics;
  const auto m = machine_of_ini(text, "mine.ini", diagnostics);
  return m ? "" : m.error().text();
}

TEST(MachineOfIni, SaysWhatItCannotTake) {
  EXPECT_EQ(message_of(kIni, "xyzac-trt-kins sparm=identityfirst", "trivkins coordinates=XYZAC")
                .find("mine.ini:5:1: error: "),
            0U);
  EXPECT_EQ(message_of(kIni, "LINEAR_UNITS = inch", "LINEAR_UNITS = ell"),
            "mine.ini:12:1: error: LINEAR_UNITS is 'ell', neither mm nor inch");
  EXPECT_EQ(message_of(kIni, "MAX_LIMIT = 50", "MAX_LIMIT = fifty"),
            "mine.ini:25:1: error: MAX_LIMIT in [JOINT_3] is 'fifty', no number");
  EXPECT_EQ(message_of(kIni, "sets :y 20", "sets :y y"),
            "mine.ini: error: the value of xyzac-trt-kins.y-offset is no number");
  EXPECT_EQ(message_of(kIni, "[KINS]", "[KIN]"), "mine.ini: error: no KINEMATICS in [KINS]");
  EXPECT_NE(message_of(kIni, "MIN_LIMIT = -36000", ""), "");
}

// Closed forms: the tilt of an A-C table is A itself, whose smaller travel bounds it where C cannot turn on.
TEST(MachineReach, IsTheTravelOfTheTilt) {
  NewMachine m = ac_machine();
  const auto reach_of = [&] {
    Diagnostics diagnostics;
    return machine_reach(*parse_machine(machine_file_text(m, "x"), "new.toml", diagnostics));
  };
  EXPECT_NEAR(reach_of().every_way.deg(), 120.0, 1e-9);
  m.travel['A'] = {-20.0 * kRadPerDegree, 45.0 * kRadPerDegree, false};
  EXPECT_NEAR(reach_of().every_way.deg(), 45.0, 1e-9);
  m.travel['C'] = {-85.0 * kRadPerDegree, 85.0 * kRadPerDegree, false};  // some directions need C beyond it
  EXPECT_LT(reach_of().every_way.deg(), 20.0);
  EXPECT_NEAR(reach_of().one_way.deg(), 45.0, 1e-9);
}

// A part zero 100 mm up from both axes: tilted by 90 deg it stands at Y = -+100, beyond a travel of 60.
TEST(MachineReach, FindsATravelThatIsTooSmall) {
  NewMachine m = ac_machine();
  m.points_mm = {{'A', {0, 0, -100}}, {'C', {0, 0, -100}}};
  m.travel['A'] = {-kPi / 2.0, kPi / 2.0, false};
  m.travel['Y'] = {-60.0, 60.0, false};
  m.part_zero_mm = Vec3::Zero();
  m.tool_length_mm = 0.0;
  Diagnostics diagnostics;
  const auto reach = machine_reach(*parse_machine(machine_file_text(m, "x"), "new.toml", diagnostics));
  ASSERT_EQ(reach.beyond.size(), 1U);
  EXPECT_EQ(reach.beyond[0].axis, 1U);
  EXPECT_NEAR(reach.beyond[0].by_mm, 40.0, 1e-9);
}

}  // namespace
}  // namespace trunnion
