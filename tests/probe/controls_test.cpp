// Other controls than LinuxCNC: programs in their words, and their own numbers for the rotary axes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/probe/control_numbers.hpp"
#include "trunnion/probe/program.hpp"
#include "trunnion/probe/reading.hpp"
#include "trunnion/probe/strokes.hpp"

#include "probe/given.hpp"
#include "probe/macro_control.hpp"
#include "probe/other_words.hpp"
#include "support/cases.hpp"

namespace trunnion::probe {
namespace {

using test::Given;
using testing::HasSubstr;

TEST(ProbeControls, ProgramsAreReadBackWithoutAFault) {
  for (const char* name : {"fanuc_30i", "haas_ngc"}) {
    const Given given("trunnion_offset", name);
    const auto program = make_program(given.machine, given.control, given.options());
    ASSERT_TRUE(program) << name << ": " << program.error().text();
    EXPECT_THAT(program->text, HasSubstr("POPEN")) << name;
    EXPECT_THAT(program->text, HasSubstr("NOBODY HAS RUN THESE PROBING WORDS")) << name;
    EXPECT_THAT(program->text, HasSubstr("G31 X68.544 Y40. Z34.71 F60.")) << name;
    Diagnostics diagnostics;
    const auto strokes = read_strokes(given.machine, given.control, program->text, "p.nc", diagnostics);
    ASSERT_TRUE(strokes) << name << ": " << strokes.error().text();
    EXPECT_EQ(strokes->touches.size(), program->touches) << name;
    EXPECT_THAT(faults_of(given.machine, *strokes), testing::IsEmpty()) << name;
    // A record behind each touch.
    std::size_t records = 0;
    for (auto at = program->text.find("DPRNT"); at != std::string::npos;
         at = program->text.find("DPRNT", at + 1))
      ++records;
    EXPECT_EQ(records, program->touches) << name;
  }
}

// The words of a control, run on a machine behind it by a runner that was written apart, its log as it writes
// it, and that log read.
struct OtherWords {
  const char* control;
  std::string (*for_runner)(const std::string&);
  const char* log;
  const char* touch;  // the second touch of the first pose
};

TEST(ProbeControls, TouchTheBallInTheirOwnWordsAndTheirLogsAreRead) {
  const OtherWords all[] = {{"siemens_840d_sl", test::siemens_for_runner, "X%.4f Y%.4f Z%.4f\n",
                             "MEAS=1 G1 X68.5437 Y40 Z34.71 F60\n"},
                            {"heidenhain_tnc640", test::klartext_for_runner, "X=%9.4f Y=%9.4f Z=%9.4f\n",
                             "TCH PROBE 4.2 IX-13.8663 IY+0 IZ+0\n"}};
  for (const OtherWords& one : all) {
    const Given given("trunnion_offset", one.control);
    ProgramOptions options = given.options();
    options.log = "TOUCHES";
    const auto program = make_program(given.machine, given.control, options);
    ASSERT_TRUE(program) << one.control << ": " << program.error().text();
    EXPECT_THAT(program->text, HasSubstr(one.touch));
    Diagnostics diagnostics;
    const auto strokes = read_strokes(given.machine, given.control, program->text, "p.nc", diagnostics);
    ASSERT_TRUE(strokes) << one.control << ": " << strokes.error().text();
    EXPECT_EQ(strokes->touches.size(), program->touches) << one.control;
    EXPECT_THAT(faults_of(given.machine, *strokes), testing::IsEmpty()) << one.control;
    auto hidden = given.hidden(options.ball);
    hidden.ball[0] += 1.5;
    hidden.c_point[1] += 1.0;
    hidden.noise_mm = 0.0005;
    const auto run = test::run_probing(one.for_runner(program->text), hidden, 1);
    EXPECT_EQ(run.touches, program->touches) << one.control;
    EXPECT_GT(run.nearest_mm, 1.0) << one.control;
    const auto reading =
        read_touches(given.machine, *strokes, test::log_as(run.log, one.log), "touches.txt", {});
    ASSERT_TRUE(reading) << one.control << ": " << reading.error().text();
    EXPECT_NEAR(reading->radius_mm, 15.7, 0.001);
  }
}

struct MacroProgram {
  std::string text;
  Strokes strokes;
  test::HiddenMachine hidden;
};

MacroProgram macro_program(const Given& given) {
  ProgramOptions options = given.options();
  options.log = "TOUCHES";
  auto program = make_program(given.machine, given.control, options);
  if (!program) throw std::runtime_error(program.error().text());
  Diagnostics diagnostics;
  auto strokes = read_strokes(given.machine, given.control, program->text, "p.nc", diagnostics);
  if (!strokes) throw std::runtime_error(strokes.error().text());
  test::HiddenMachine hidden = given.hidden(options.ball);
  hidden.ball[0] += 1.5;
  hidden.c_point[1] += 1.0;
  return {std::move(program->text), std::move(*strokes), hidden};
}

// Whatever #5063 holds on the control.
TEST(ProbeControls, MacroControlsTouchTheBallAndTheirLogsAreRead) {
  for (const char* name : {"fanuc_30i", "haas_ngc"}) {
    const Given given("trunnion_offset", name);
    const MacroProgram program = macro_program(given);
    for (const double skip_z_mm : {0.0, 150.0}) {
      if (skip_z_mm != 0.0 && given.control.probing.first.empty()) continue;
      test::MacroTrouble trouble;
      trouble.skip_z_mm = skip_z_mm;
      const auto run = test::MacroControl(program.hidden, trouble).run(program.text);
      EXPECT_EQ(run.alarm, "") << name;
      EXPECT_EQ(run.records, program.strokes.touches.size()) << name;
      EXPECT_EQ(run.pressed_mm, 0.0) << name;
      const auto reading = read_touches(given.machine, program.strokes, run.log, "touches.txt", {});
      ASSERT_TRUE(reading) << name << ": " << reading.error().text();
      EXPECT_NEAR(reading->radius_mm, 15.7, 0.001) << name;
    }
  }
}

// A ball that is not there, one that is where nothing is expected, a probe that is pressed from the start: an
// alarm before anything else moves on, and no line in the log for a touch that was none.
TEST(ProbeControls, MacroControlsStopWhereATouchIsMissedOrUnexpected) {
  for (const char* name : {"fanuc_30i", "haas_ngc"}) {
    const Given given("trunnion_offset", name);
    const MacroProgram program = macro_program(given);
    const double skip_z_mm = given.control.probing.first.empty() ? 0.0 : 150.0;
    for (std::size_t touch = 0; touch < program.strokes.touches.size(); ++touch) {
      test::MacroTrouble trouble;
      trouble.skip_z_mm = skip_z_mm;
      trouble.gone_at_touch = touch;
      const auto run = test::MacroControl(program.hidden, trouble).run(program.text);
      EXPECT_TRUE(run.alarm == "M79" || run.alarm == "#3000=1(NOTHING WAS TOUCHED)")
          << name << " " << run.alarm;
      EXPECT_EQ(run.records, touch) << name;
    }
    std::mt19937_64 random(5);
    int stopped = 0;
    for (int i = 0; i < test::cases(300); ++i) {
      // On a motion between touches.
      const auto& moves = program.strokes.moves;
      const Move& move = moves[std::uniform_int_distribution<std::size_t>(0, moves.size() - 1)(random)];
      if (!move.guarded || !move.knows_from) continue;
      const Vec3 way = forward(given.machine, move.to, {0, 0, -given.machine.tool_length_mm}).p -
                       forward(given.machine, move.from, {0, 0, -given.machine.tool_length_mm}).p;
      if (way.norm() < 5.0) continue;  // at the top nothing is watched yet
      test::MacroTrouble trouble;
      trouble.skip_z_mm = skip_z_mm;
      // In machine axes: they carry the tool.
      test::Triple at{};
      for (std::size_t k = 0; k < 3; ++k) {
        const AxisId id = *given.machine.axis(std::string(1, "XYZ"[k]));
        at[k] = 0.5 * (move.from[id] + move.to[id]) - (k == 2 ? given.machine.tool_length_mm : 0.0);
      }
      trouble.obstacle = at;
      const auto run = test::MacroControl(program.hidden, trouble).run(program.text);
      EXPECT_NE(run.alarm, "") << name;
      EXPECT_EQ(run.pressed_mm, 0.0) << name << " line " << move.line;
      ++stopped;
    }
    std::printf("[ figures  ] %s: %zu missed touches, %d obstacles\n", name, program.strokes.touches.size(),
                stopped);
    EXPECT_GT(stopped, test::cases(300) / 4) << name;
    test::MacroTrouble pressed;
    pressed.skip_z_mm = skip_z_mm;
    pressed.pressed = true;
    const auto run = test::MacroControl(program.hidden, pressed).run(program.text);
    EXPECT_TRUE(run.alarm == "M78" || run.alarm == "#3000=2(TOUCHED ON THE WAY)") << name << " " << run.alarm;
    EXPECT_LE(run.records, 1U) << name;
  }
}

// Without the lines that watch, the program is refused; so is one that goes down on a motion that nothing
// stops.
TEST(ProbeControls, ProgramsThatDoNotWatchAreRefused) {
  for (const char* name : {"fanuc_30i", "haas_ngc", "siemens_840d_sl"}) {
    const Given given("trunnion_offset", name);
    const MacroProgram program = macro_program(given);
    EXPECT_THAT(faults_of(given.machine, program.strokes), testing::IsEmpty()) << name;
    std::vector<std::string> lines;
    std::istringstream text(program.text);
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    std::size_t watching = 0;
    std::size_t downs = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const bool watches = lines[i].find("IF[") != std::string::npos ||
                           lines[i].find(" M7") != std::string::npos ||
                           lines[i].find(" IF $AC_MEA") != std::string::npos;
      if (!watches || i % 7 != 0) continue;
      ++watching;
      const auto refused = [&](const std::vector<std::string>& changed) {
        std::string all;
        for (const std::string& line : changed) all += line + "\n";
        Diagnostics diagnostics;
        const auto strokes = read_strokes(given.machine, given.control, all, "p.nc", diagnostics);
        return !strokes || !faults_of(given.machine, *strokes).empty();
      };
      std::vector<std::string> without = lines;
      without.erase(without.begin() + static_cast<std::ptrdiff_t>(i));
      EXPECT_TRUE(refused(without)) << name << ": " << lines[i];
      // The motion before it as a plain one.
      if (lines[i].find("M79") != std::string::npos || lines[i].find("LT0.5") != std::string::npos ||
          lines[i].find("NOTOUCH") != std::string::npos)
        continue;
      std::string& motion = without[i - 1];
      if (const auto at = motion.find("G31"); at != std::string::npos) motion.replace(at, 3, "G1");
      if (const auto at = motion.find(" MEAS=1"); at != std::string::npos) motion.erase(at);
      EXPECT_TRUE(refused(without)) << name << ": " << motion;
      downs += 1;
    }
    EXPECT_GT(watching, 10U) << name;
    EXPECT_GT(downs, 5U) << name;
  }
}

// A touch that says its way, not its end, must say the same length twice.
TEST(ProbeControls, AWayThatIsNotAsLongAsItSaysIsAnError) {
  const Given given("trunnion_offset", "heidenhain_tnc640");
  auto program = make_program(given.machine, given.control, given.options());
  ASSERT_TRUE(program);
  const auto at = program->text.find("ABST+13.8663");
  ASSERT_NE(at, std::string::npos);
  program->text.replace(at, 12, "ABST+23.8663");
  Diagnostics diagnostics;
  const auto strokes = read_strokes(given.machine, given.control, program->text, "p.nc", diagnostics);
  ASSERT_FALSE(strokes);
  EXPECT_THAT(diagnostics.findings().front().message, HasSubstr("length of the touch"));
}

TEST(ProbeControls, WithoutWordsForTouchesAreRefused) {
  for (const char* name : {"iso", "hnc_8"}) {
    const Given given("trunnion_offset", name);
    const auto program = make_program(given.machine, given.control, given.options());
    ASSERT_FALSE(program) << name;
    EXPECT_THAT(program.error().message, HasSubstr("[probing] touch")) << name;
  }
}

// A = about X through (y 1, z -66), C = about Z through (x 0.5, y 0.7): worked out by hand.
Machine worked_example(const Given& given) {
  Machine out = given.machine;
  out.axes[*out.axis("A")].direction = {-1, 0, 0};
  out.axes[*out.axis("A")].point_mm = {100, 1, -66};
  out.axes[*out.axis("C")].direction = {0, 0, -1};
  out.axes[*out.axis("C")].point_mm = {0.5, 0.7, -30};
  return out;
}

std::string numbers_of(const char* control) {
  const Given given("trunnion_offset", control);
  const auto lines = control_numbers(worked_example(given), given.control);
  if (!lines) return lines.error().text();
  std::string out;
  for (const std::string& line : *lines) out += line + "\n";
  return out;
}

TEST(ControlNumbers, AreThoseOfAWorkedExample) {
  EXPECT_EQ(numbers_of("linuxcnc"),
            "setp xyzac-trt-kins.x-rot-point 0.5000\nsetp xyzac-trt-kins.y-rot-point 0.7000\n"
            "setp xyzac-trt-kins.z-rot-point -66.0000\nsetp xyzac-trt-kins.y-offset 0.3000\n"
            "setp xyzac-trt-kins.z-offset 0.0000\n"
            "# setp xyzac-trt-kins.conventional-directions 1   (LinuxCNC later than 2.9.0~pre1; without this "
            "pin it is 0)\n");
  EXPECT_EQ(numbers_of("fanuc_30i"),
            "N19680 P12\nN19682 P1\nN19684 P1\nN19687 P3\nN19689 P1\nN19697 P3\nN19700 P0.5000\n"
            "N19701 P1.0000\nN19702 P-66.0000\nN19703 P0.0000\nN19704 P-0.3000\nN19705 P0.0000\n");
  const std::string swivel = numbers_of("siemens_840d_sl");
  EXPECT_THAT(swivel, HasSubstr("$TC_CARR5[1]=1.0000\n"));
  EXPECT_THAT(swivel, HasSubstr("$TC_CARR16[1]=-0.3000\n"));
  EXPECT_THAT(swivel, HasSubstr("$TC_CARR20[1]=66.0000\n"));
  EXPECT_THAT(swivel, HasSubstr("$TC_CARR7[1]=1.000000000\n"));
  EXPECT_THAT(swivel, HasSubstr("$MC_TRAFO5_JOINT_OFFSET_1[1]=-0.3000\n"));
  EXPECT_THAT(numbers_of("heidenhain_tnc640"), HasSubstr("translation X 0.5000 Y 1.0000 Z -66.0000 mm"));
  EXPECT_THAT(numbers_of("haas_ngc"),
              HasSubstr("the first axis passes through X 0.5000 Y 1.0000 Z -66.0000 mm"));
  EXPECT_THAT(numbers_of("iso"), HasSubstr("no lines for the rotary axes AC"));
}

TEST(ControlNumbers, SayWhichDirectionTheyDoNotHold) {
  const Given given("trunnion_offset");
  Machine machine = worked_example(given);
  machine.axes[*machine.axis("C")].direction = Vec3(0.01, 0, -1).normalized();
  const auto lines = control_numbers(machine, given.control);
  ASSERT_TRUE(lines);
  EXPECT_EQ(lines->back(), "these numbers do not hold that axis C is 0.5729 deg off machine Z");
}

// LinuxCNC's kinematics are of square axes, and have one sense for both: no numbers for another machine.
TEST(ControlNumbers, AreRefusedForAMachineThatTheControlHasNoneFor) {
  const Given oblique("nutating_45");
  const auto none = control_numbers(oblique.machine, oblique.control);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("axis B is 45.0000 deg off machine Y"));
  const Given given("trunnion_offset");
  Machine machine = worked_example(given);
  machine.axes[*machine.axis("C")].direction = {0, 0, 1};
  const auto mixed = control_numbers(machine, given.control);
  ASSERT_FALSE(mixed);
  EXPECT_THAT(mixed.error().message, HasSubstr("A and C turn opposite ways"));
  // Fanuc has a number for each.
  const Given fanuc("trunnion_offset", "fanuc_30i");
  const auto lines = control_numbers(machine, fanuc.control);
  ASSERT_TRUE(lines) << lines.error().text();
  EXPECT_THAT(*lines, testing::IsSupersetOf({"N19684 P1", "N19689 P0"}));
}

// What `control_numbers` writes is read back as the same two lines: of a machine whose axes pass each other.
TEST(ControlNumbers, ReadBackAreTheSameAxes) {
  for (const char* control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640", "haas_ngc"}) {
    const Given given("trunnion_offset", control);
    const Machine machine = worked_example(given);
    const std::string text = "; a list of everything\nN19999 P5\n" + numbers_of(control);
    Diagnostics diagnostics;
    const auto places = axis_places({"list.txt", text}, "AC", given.control, diagnostics);
    ASSERT_TRUE(places) << control << ": " << places.error().text();
    for (const char letter : {'A', 'C'}) {
      const Axis& axis = machine.axes[*machine.axis(std::string(1, letter))];
      ASSERT_TRUE(places->points_mm.contains(letter)) << control;
      const Vec3 off = places->points_mm.at(letter) - axis.point_mm;
      EXPECT_LT(off.cross(axis.direction).norm(), 1e-4) << control << " " << letter;
    }
    // The lines of Haas hold no sense.
    const bool holds_sense = std::string(control) != "haas_ngc";
    EXPECT_EQ(places->table_turns_positively, holds_sense ? std::optional(false) : std::nullopt) << control;
    EXPECT_THAT(diagnostics.findings(), testing::IsEmpty()) << control;
  }
}

TEST(ControlNumbers, ALineThatWasLeftOutIsNamed) {
  Diagnostics diagnostics;
  const Given haas("trunnion_offset", "haas_ngc");
  const auto places = axis_places({"settings.txt", "SETTING 255 = -381\nSETTING 256 = -254\n", 1.0}, "BC",
                                  haas.control, diagnostics);
  ASSERT_TRUE(places) << places.error().text();
  EXPECT_TRUE(places->points_mm.empty());
  ASSERT_EQ(diagnostics.findings().size(), 1U);
  EXPECT_EQ(diagnostics.findings()[0].text(),
            "settings.txt: warning: no line 'SETTING 257 = ...': its other numbers are there");
}

// A decimal comma was cut off: the axis stood 24 mm elsewhere.
TEST(ControlNumbers, WhatGoesOnBehindANumberIsRefused) {
  const Given haas("trunnion_offset", "haas_ngc");
  const auto said = [&](const std::string& number, double mm_per_unit) {
    Diagnostics diagnostics;
    const auto places = axis_places(
        {"settings.txt", "SETTING 255 = " + number + "\nSETTING 256 = -8\nSETTING 257 = -7\n", mm_per_unit},
        "BC", haas.control, diagnostics);
    return places ? std::string() : places.error().text();
  };
  for (const char* wrong : {"-9,9410", "-9'941", "1e3", "-9.5E-1"})
    EXPECT_THAT(said(wrong, 25.4), testing::AllOf(testing::HasSubstr("settings.txt:1:1: error"),
                                                  testing::HasSubstr("is no number here")))
        << wrong;
  EXPECT_THAT(said("-9.9410mm", 25.4), testing::HasSubstr("read in inches"));
  EXPECT_THAT(said("-9.9410 in", 1.0), testing::HasSubstr("read in mm"));
  for (const char* right : {"-9.941", "-9.9410 ; B", "-9.9410 (C, 5)", "-9.941 IN", "-9.941 inch"})
    EXPECT_EQ(said(right, 25.4), "") << right;
  EXPECT_EQ(said("-252.5 mm", 1.0), "");
}

TEST(ControlNumbers, AsPeopleCopyThem) {
  Diagnostics diagnostics;
  const Given haas("trunnion_offset", "haas_ngc");
  const auto crossing =
      axis_places({"settings.txt", "setting 255=-9.941\n SETTING 256 =-8.059\nSetting 257 = -8.287\n", 25.4},
                  "BC", haas.control, diagnostics);
  ASSERT_TRUE(crossing) << crossing.error().text();
  for (const char letter : {'B', 'C'})
    EXPECT_LT((crossing->points_mm.at(letter) - 25.4 * Vec3(-9.941, -8.059, -8.287)).norm(), 1e-12);
  const Given siemens("trunnion_offset", "siemens_840d_sl");
  // An archive of machine data: block numbers before, other data between.
  const std::string archive =
      "N24100 $MC_TRAFO_TYPE_1=40\nN24550 $MC_TRAFO5_BASE_TOOL_1[0]=1\nN24550 $MC_TRAFO5_BASE_TOOL_1[1]=2.5\n"
      "N24550 $MC_TRAFO5_BASE_TOOL_1[2]=-300\nN24560 $MC_TRAFO5_JOINT_OFFSET_1[0]=0\n"
      "N24560 $MC_TRAFO5_JOINT_OFFSET_1[1]=-.5\nN24560 $MC_TRAFO5_JOINT_OFFSET_1[2]=40\n"
      "N24570 $MC_TRAFO5_AXIS1_1[0]=-1\nN24570 $MC_TRAFO5_AXIS1_1[1]=0\nN24570 $MC_TRAFO5_AXIS1_1[2]=0\n"
      "N24570 $MC_TRAFO5_AXIS1_10[2]=7\n";
  const auto data = axis_places({"md.txt", archive}, "AC", siemens.control, diagnostics);
  ASSERT_TRUE(data) << data.error().text();
  EXPECT_EQ(data->points_mm.at('A'), Vec3(1, 2.5, -300));
  EXPECT_EQ(data->points_mm.at('C'), Vec3(1, 2, -260));
  EXPECT_EQ(data->table_turns_positively, std::optional(true));
}

TEST(ControlNumbers, ThatContradictEachOtherAreRefused) {
  Diagnostics diagnostics;
  const Given given("trunnion_offset", "siemens_840d_sl");
  const auto refused = [&](const std::string& text) {
    const auto places = axis_places({"list.txt", text}, "AC", given.control, diagnostics);
    return places ? std::string("taken") : places.error().text();
  };
  EXPECT_THAT(refused("$TC_CARR4[1]=1\n$TC_CARR4[1]=2\n"),
              HasSubstr("list.txt:2:1: error: this is 2, and line 1 says 1"));
  EXPECT_THAT(refused("nothing of it\n"), HasSubstr("no line is one of these of"));
  std::string text = numbers_of("siemens_840d_sl");
  const auto at = text.find("$TC_CARR20[1]=66");
  text.replace(at, 16, "$TC_CARR20[1]=67");
  EXPECT_THAT(refused(text), HasSubstr("and line"));  // TRAFO5's part offset says the same number
  EXPECT_THAT(refused("$TC_CARR4[1]=1\n$TC_CARR5[1]=0\n$TC_CARR6[1]=0\n$TC_CARR15[1]=0\n$TC_CARR16[1]=0\n"
                      "$TC_CARR17[1]=9\n$TC_CARR18[1]=-1\n$TC_CARR19[1]=0\n$TC_CARR20[1]=-8\n"),
              HasSubstr("axis C is 1 mm elsewhere"));
  EXPECT_THAT(refused("$TC_CARR7[1]=1\n$TC_CARR8[1]=0\n$TC_CARR9[1]=0\n$TC_CARR10[1]=0\n$TC_CARR11[1]=0\n"
                      "$TC_CARR12[1]=-1\n"),
              HasSubstr("turn in opposite senses"));
}

}  // namespace
}  // namespace trunnion::probe
