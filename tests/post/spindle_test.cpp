#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

using testing::HasSubstr;

const std::string kPath = "RAPID\nGOTO/0,0,20,0,0,1\nGOTO/0,0,10,0,0,1\nGOTO/5,0,10,0,0,1\n";

test::Posted spindle_program(const std::string& words, const Machine& machine) {
  return test::posted("MULTAX\nFEDRAT/MMPM,500\n" + words + "FINI\n", machine, {}, "iso");
}

std::string refusal(const std::string& words) {
  const auto p = spindle_program(words, test::shipped_machine("trunnion_offset"));
  return p.report ? "" : p.report.error().text();
}

// A digit too many: a tool that flies apart, or a control that stops in the middle of the part.
TEST(SpindleSpeed, IsNotAboveThatOfTheMachine) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.file = "m.toml";
  machine.spindle_max_rpm = 12000.0;
  EXPECT_TRUE(spindle_program("SPINDL/12000,CLW\n" + kPath, machine).report);
  const auto fast = spindle_program("SPINDL/12001,CLW\n" + kPath, machine);
  ASSERT_FALSE(fast.report);
  EXPECT_THAT(fast.report.error().text(),
              HasSubstr("part.cls:3:1: error: SPINDL: 12001 rpm, and the spindle turns at 12000 rpm at most "
                        "([spindle] max_rpm of m.toml)"));
  EXPECT_FALSE(spindle_program("CUTTER/1\nSPINDL/100,SMM,CLW\n" + kPath, machine).report);  // 31831 rpm
  EXPECT_TRUE(spindle_program("CUTTER/1\nSPINDL/100,SMM,CLW,MAXRPM,12000\n" + kPath, machine).report);
  // Another program, and a CL file that asks for as much.
  const std::string cl = "FEDRAT/MMPM,500\nSPINDL/15000,CLW\n" + kPath + "FINI\n";
  const std::string nc =
      spindle_program("SPINDL/15000,CLW\n" + kPath, test::shipped_machine("trunnion_offset")).nc;
  const auto judged = test::verified(nc, cl, machine, 0.01, "iso");
  ASSERT_TRUE(judged) << judged.error().text();
  EXPECT_FALSE(judged->passed());
  EXPECT_TRUE(test::verified(nc, cl, test::shipped_machine("trunnion_offset"), 0.01, "iso")->passed());
}

// The diameter of the tool before would make the speed of this one: a face mill at that of a drill.
TEST(SurfaceSpeed, IsThatOfTheToolsOwnDiameter) {
  const std::string first = "CUTTER/10\nLOADTL/1,LENGTH,100\nSPINDL/100,SMM,CLW\n" + kPath;
  const auto second = [&](const std::string& words) { return first + words + kPath; };
  EXPECT_EQ(refusal(second("CUTTER/50\nLOADTL/2,LENGTH,100\nSPINDL/100,SMM,CLW\n")), "");
  EXPECT_EQ(refusal(second("LOADTL/2,LENGTH,100\nCUTTER/50\nSPINDL/100,SMM,CLW\n")), "");
  EXPECT_EQ(refusal(second("LOADTL/1\nSPINDL/100,SMM,CLW\n")), "");
  EXPECT_EQ(refusal(second("LOADTL/2,LENGTH,100\nSPINDL/900,CLW\nCUTTER/50\n")), "");
  EXPECT_EQ(
      refusal(second("LOADTL/2,LENGTH,100\nSPINDL/100,SMM,CLW\n")),
      "part.cls:11:1: error: SPINDL gives a surface speed and no CUTTER or TLDATA a diameter of tool 2");
  EXPECT_EQ(refusal(second("CUTTER/12\nLOADTL/2,LENGTH,100\nSPINDL/100,SMM,CLW\nCUTTER/50\n")),
            "part.cls:13:1: error: a diameter of 50 mm behind SPINDL, which made its speed from a surface "
            "speed and "
            "12 mm: CUTTER or TLDATA must stand before SPINDL");
  const std::string nc = spindle_program(second("CUTTER/50\nLOADTL/2,LENGTH,100\nSPINDL/100,SMM,CLW\n"),
                                         test::shipped_machine("trunnion_offset"))
                             .nc;
  EXPECT_THAT(nc, HasSubstr("S3183 M3"));  // 100 m/min at 10 mm
  EXPECT_THAT(nc, HasSubstr("S637 M3"));   // and at 50 mm
}

// Right as it may be for the tool before: another one breaks.
TEST(SpindleSense, ToTheLeftIsSaidForEachTool) {
  const std::string first = "LOADTL/4\nSPINDL/3000,CCLW\n" + kPath;
  const std::string up = "RAPID\nGOTO/5,0,30,0,0,1\n";
  EXPECT_THAT(refusal(first + up + "LOADTL/5\n" + kPath),
              HasSubstr("the tool before turned counterclockwise"));
  EXPECT_EQ(refusal(first + up + "LOADTL/5\nSPINDL/3000,CLW\n" + kPath), "");
  EXPECT_EQ(refusal(first + up + "LOADTL/5\nSPINDL/3000,CCLW\n" + kPath), "");
  EXPECT_EQ(refusal(first + up + "LOADTL/4\n" + kPath), "");
  EXPECT_EQ(refusal("SPINDL/3000,CCLW\nLOADTL/4\n" + kPath), "");  // there is no tool before
  EXPECT_EQ(refusal("LOADTL/4\nSPINDL/3000,CLW\n" + kPath + up + "LOADTL/5\n" + kPath), "");
}

}  // namespace
}  // namespace trunnion::post
