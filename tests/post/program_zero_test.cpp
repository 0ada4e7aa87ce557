#include "trunnion/post/program_zero.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <string>

#include "post/making/program_name.hpp"
#include "post/posting.hpp"

namespace trunnion::post {
namespace {

Machine shifted_machine() {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.part_zero_mm = Vec3(12.0, -7.0, 33.0);
  return machine;
}

Vec3 xyz_of(const ProgramZero::Place& place) {
  return {place.at_mm.at(0), place.at_mm.at(1), place.at_mm.at(2)};
}

// What a control does under tool-centre-point control, from its own data: the point of the part stands at the
// work offset plus the words while the table is at 0, turns with the table, and the gauge point is a tool
// length above it.
TEST(ProgramZero, UnderToolCentrePointControlIsWhereTheControlNeedsIt) {
  const Machine machine = shifted_machine();
  const auto zero = program_zero(machine, test::shipped_controller("fanuc_30i"), 1, WordsOf::part);
  const Vec3 tool(0.0, 0.0, -120.0);
  const Axis& A = machine.axes[*machine.axis("A")];
  const Axis& C = machine.axes[*machine.axis("C")];
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  for (int i = 0; i < 50; ++i) {
    const Vec3 tip_P(60.0 * any(random), 60.0 * any(random), 40.0 * any(random));
    JointVector q;
    q[*machine.axis("A")] = 1.2 * any(random);
    q[*machine.axis("C")] = 3.0 * any(random);
    const auto turned = [&](const Axis& axis, double angle, const Vec3& p) {
      return Vec3(Eigen::AngleAxisd(angle, axis.direction) * (p - axis.point_mm) + axis.point_mm);
    };
    Vec3 at_M = xyz_of(zero.offset) + tip_P;
    at_M = turned(C, q[*machine.axis("C")], at_M);
    at_M = turned(A, q[*machine.axis("A")], at_M);
    solve_linear(machine, tip_P, tool, q);
    const Vec3 gauge_M(q[*machine.axis("X")], q[*machine.axis("Y")], q[*machine.axis("Z")]);
    EXPECT_LT((gauge_M - (at_M - tool)).norm(), 1e-9);
  }
  EXPECT_EQ(zero.offset_name, "G54");
}

// Word + work offset + tool length is where the gauge point stands: over the point of the part, a tool length
// above it.
TEST(ProgramZero, WithoutItWordsCountFromTheWorkOffset) {
  Machine machine = shifted_machine();
  machine.work_offset_mm = Vec3(5.0, -3.0, 20.0);
  const auto zero = program_zero(machine, test::shipped_controller("linuxcnc"), 1, WordsOf::tip);
  const auto p =
      test::posted("LOADTL/1,LENGTH,80\nFEDRAT/MMPM,500\nRAPID\nGOTO/1,2,30\nGOTO/1,2,3\nFINI\n", machine);
  ASSERT_TRUE(p.report);
  const Vec3 point_P(1.0, 2.0, 30.0);
  const Vec3 word_M = machine.part_zero_mm + point_P - xyz_of(zero.offset);
  EXPECT_NE(p.nc.find("X" + fixed_text(word_M.x(), 4) + " Y" + fixed_text(word_M.y(), 4) + "\nZ" +
                      fixed_text(word_M.z(), 4) + "\n"),
            std::string::npos)
      << p.nc;
  EXPECT_NE(p.nc.find("(G54 must be at machine X5.000 Y-3.000 Z20.000 with A0 C0)\n"
                      "(the part zero must be at machine X12.000 Y-7.000 Z33.000 with A0 C0)\n"),
            std::string::npos)
      << p.nc;
}

std::vector<std::string> warnings_of(const Machine& machine, WordsOf words) {
  Diagnostics d;
  warn_of_zero(machine, program_zero(machine, test::shipped_controller("linuxcnc"), 1, words), 100.0, d);
  std::vector<std::string> out;
  for (const auto& finding : d.findings()) out.push_back(finding.message);
  return out;
}

TEST(ProgramZero, WhatCanHardlyBeMeantIsAWarning) {
  Machine machine = test::shipped_machine("trunnion_offset");
  EXPECT_TRUE(warnings_of(machine, WordsOf::tip).empty());
  machine.part_zero_mm = Vec3(0.0, -450.0, 0.0);
  ASSERT_EQ(warnings_of(machine, WordsOf::tip).size(), 1U);
  EXPECT_NE(warnings_of(machine, WordsOf::tip)[0].find(
                "X0.000 Y-450.000 Z0.000 and G54 must be zero at the control"),
            std::string::npos);
  EXPECT_TRUE(warnings_of(machine, WordsOf::part).empty());
  machine.work_offset_mm = Vec3(0.0, -650.0, 0.0);
  ASSERT_EQ(warnings_of(machine, WordsOf::tip).size(), 1U);
  EXPECT_EQ(warnings_of(machine, WordsOf::tip)[0],
            "the zero of G54 would be at machine Y -650.000, 150.000 mm beyond the travel of -500.000 to "
            "500.000 mm and "
            "farther than the tool of 100 mm reaches");
}

TEST(ProgramZero, AnotherWorkOffsetIsCalled) {
  PostOptions options;
  options.work_offset = 3;
  const std::string cl = "FEDRAT/MMPM,500\nGOTO/0,0,3\nGOTO/1,0,3\nFINI\n";
  for (const auto& [control, words] :
       {std::pair{"linuxcnc", "G56\n"}, {"siemens_840d_sl", " G56\n"}, {"heidenhain_tnc640", "Q339=+3\n"}}) {
    const auto p = test::posted(cl, test::shipped_machine("trunnion_offset"), options, control);
    ASSERT_TRUE(p.report) << control;
    EXPECT_TRUE(p.report->verification->passed());
    EXPECT_NE(p.nc.find(words), std::string::npos) << p.nc;
    EXPECT_LT(p.nc.find(words), p.nc.find(control == std::string("heidenhain_tnc640") ? "FMAX" : "G0"));
  }
  options.work_offset = 7;
  EXPECT_FALSE(test::posted(cl, test::shipped_machine("trunnion_offset"), options, "iso").report);
}

TEST(ProgramName, IsMadeOfWhatControlsTake) {
  EXPECT_EQ(name_for_control("  Bracket 4711 / rev. B "), "Bracket_4711_rev_B");
  EXPECT_EQ(name_for_control("()%;"), "");
  EXPECT_EQ(name_for_control(std::string(100, 'x')).size(), 24U);
  EXPECT_EQ(number_in_name("Bracket_4711_rev_2"), 4711);
  EXPECT_EQ(number_in_name("Bracket"), 1);
  EXPECT_EQ(number_in_name("P123456"), 1);
  EXPECT_EQ(number_in_name("A-12-34"), 12);
}

// Loaded as O9001 it would run at the next tool change of many machines.
TEST(ProgramName, IsNoNumberOfAMacro) {
  const std::string cl = "PARTNO ROTOR 9001\nFEDRAT/MMPM,500\nGOTO/0,0,3\nGOTO/1,0,3\nFINI\n";
  PostOptions options;
  const auto of = [&](const char* control) {
    return test::posted(cl, test::shipped_machine("trunnion_offset"), options, control);
  };
  const auto count = [](const test::Posted& p, std::string_view part) {
    const auto& items = p.diagnostics.findings();
    return std::count_if(items.begin(), items.end(),
                         [&](const Finding& d) { return d.message.find(part) != std::string::npos; });
  };
  for (const char* control : {"fanuc_30i", "haas_ngc", "iso"}) {
    const auto p = of(control);
    EXPECT_TRUE(p.nc.starts_with("%\nO1\n")) << control << '\n' << p.nc;
    EXPECT_EQ(count(p, "9001 of the name 'ROTOR_9001'"), 1) << control;
  }
  EXPECT_EQ(count(of("siemens_840d_sl"), "program number"), 0);
  options.program.number = 9001;
  const auto asked = of("fanuc_30i");
  EXPECT_TRUE(asked.nc.starts_with("%\nO9001\n")) << asked.nc;
  EXPECT_EQ(count(asked, "make sure that 9001 is none of them"), 1);
  options.program.number = 7999;
  EXPECT_EQ(count(of("fanuc_30i"), "program number"), 0);
}

TEST(ProgramName, StandsInTheHead) {
  const std::string cl = "PARTNO/IMPELLER 3021\nFEDRAT/MMPM,500\nGOTO/0,0,3\nGOTO/1,0,3\nFINI\n";
  const Machine machine = test::shipped_machine("trunnion_offset");
  EXPECT_EQ(test::posted(cl, machine, {}, "haas_ngc").nc.find("%\nO3021\n"), 0U);
  EXPECT_EQ(test::posted(cl, machine, {}, "heidenhain_tnc640").nc.find("0 BEGIN PGM IMPELLER_3021 MM\n"), 0U);
  PostOptions options;
  options.program.number = 77;
  options.program.text = "blade";
  EXPECT_EQ(test::posted(cl, machine, options, "haas_ngc").nc.find("%\nO77\n"), 0U);
  EXPECT_EQ(test::posted(cl, machine, options, "heidenhain_tnc640").nc.find("0 BEGIN PGM blade MM\n"), 0U);
}

TEST(LargestCorrection, IsRefusedBeyondIt) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Model model = test::model_of(
      "[model]\nname = \"m\"\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 700\n", machine);
  const std::string cl = test::sample_path(3);
  const auto refused = test::posted(cl, machine, {}, "linuxcnc", &model);
  ASSERT_FALSE(refused.report);
  EXPECT_EQ(refused.report.error().code, ErrorCode::check_failed);
  EXPECT_NE(refused.report.error().text().find("part.cls:8:1: error: the model asks for a correction of 0."),
            std::string::npos)
      << refused.report.error().text();
  // The effect that it comes from is named: 0.7 mm at every place.
  EXPECT_NE(refused.report.error().text().find("'location:C' alone for 0.7000 mm"), std::string::npos)
      << refused.report.error().text();
  PostOptions options;
  options.largest_correction_mm = 1.0;
  EXPECT_TRUE(test::posted(cl, machine, options, "linuxcnc", &model).report);
}

TEST(GaugeLengthsOfTheHead, FitItsLine) {
  EXPECT_EQ(tools_text({{1U, 150.0, 1, LengthSource::cl_file}, {2U, 80.5, 12, LengthSource::cl_file}})
                .find("GAUGE LENGTHS T1 150, T2 80.5 REGISTER 12 ..."),
            0U);
  std::vector<LoadedTool> many;
  for (std::uint32_t i = 1; i <= 30; ++i) many.push_back({i, 100.25 + i, i, LengthSource::tool_file});
  EXPECT_EQ(tools_text(many).find("GAUGE LENGTHS T1 101.25, T2 102.25 AND 28 MORE ..."), 0U);
  EXPECT_EQ(tools_text(many).size(), tools_placeholder().size());
}

}  // namespace
}  // namespace trunnion::post
