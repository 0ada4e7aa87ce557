// The rules of each control that ships: what its file must make the writer say. The rules are those stated,
// with their sources, in the files' comments; none has been confirmed on a machine, except LinuxCNC's, whose
// interpreter reads our programs (tests/linuxcnc).
#include "support/controllers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trunnion {
namespace {

using nc::AxisLetter;
using ::testing::HasSubstr;
using ::testing::Not;

nc::Motion position(nc::MotionKind kind, const nc::Controller& c, std::array<std::int64_t, 5> mm_and_degrees,
                    nc::FeedMode mode = nc::FeedMode::per_minute, std::int64_t feed = 0) {
  nc::Motion m;
  m.kind = kind;
  m.feed_mode = mode;
  for (int d = c.numbers.feed.decimals(mode); d > 0; --d) feed *= 10;
  m.feed = feed;
  const std::array letters = {AxisLetter::X, AxisLetter::Y, AxisLetter::Z, AxisLetter::A, AxisLetter::C};
  for (std::size_t i = 0; i < 5; ++i) {
    std::int64_t quanta = mm_and_degrees[i];
    for (int d = c.numbers.axes.decimals(letters[i]); d > 0; --d) quanta *= 10;
    m.words.set(letters[i], quanta);
  }
  return m;
}

// Two tools under tool-centre-point control with a retract in between: every rule shows in it.
std::string program(const std::string& name) {
  const auto c = test::shipped_controller(name);
  const auto mode = c.has_inverse_time() ? nc::FeedMode::inverse_time : nc::FeedMode::per_minute;
  std::vector<nc::Block> blocks = {nc::ProgramStart{"PART", 7},
                                   nc::Comment{"made by (us)"},
                                   nc::WorkOffset{1},
                                   nc::ToolCall{4, 4},
                                   nc::Spindle{nc::SpindleTurn::clockwise, 12000},
                                   nc::LengthCompensation{4},
                                   position(nc::MotionKind::rapid, c, {1, 2, 100, -30, 200})};
  if (c.has_tcp()) blocks.emplace_back(nc::TcpControl{true, 4});
  blocks.emplace_back(position(nc::MotionKind::feed, c, {1, 2, 50, -30, 350}, mode, 5));
  blocks.emplace_back(position(nc::MotionKind::feed, c, {1, 3, 50, -30, 370}, mode, 5));
  if (!c.dwell.empty()) blocks.emplace_back(nc::Dwell{1500});
  if (!c.retract[2].empty()) blocks.emplace_back(test::retract_to(c, 610.0));
  blocks.emplace_back(position(nc::MotionKind::rapid, c, {1, 3, 100, -30, 370}));
  blocks.emplace_back(nc::ToolCall{5, 5});
  blocks.emplace_back(nc::ProgramEnd{});
  return test::nc_text(c, blocks);
}

TEST(Fanuc30i, SwitchesToolCentreControlOffForRetractAndToolChange) {
  const auto text = program("fanuc_30i");
  EXPECT_THAT(text, HasSubstr("%\nO7\n(MADE BY [US])\nN10 G17 G21 G40 G49 G80 G90 G94\n"));
  EXPECT_THAT(text, HasSubstr(" G0 G43 H4 X1. Y2. Z100. A-30. C200.\n"));  // G43 never without Z
  EXPECT_THAT(text, HasSubstr(" G93 G1 G43.4 H4 X1. Y2. Z50. C350. F5.\n"));
  EXPECT_THAT(text, HasSubstr(" Y3. C370. F5.\n"));  // F again, angle unwrapped
  EXPECT_THAT(text, HasSubstr(" G4 X1.5\n"));        // seconds
  EXPECT_THAT(text,
              HasSubstr(" G49\nN110 G53 G0 Z610.\nN120 G0 G43.4 H4 X1. Y3. Z100.\nN130 G49\nN140 T5 M6\n"));
  EXPECT_THAT(text, HasSubstr(" T5 M6\nN150 G17 G21 G40 G80 G90 G94\nN160 G69\nN170 G54\nN180 M30\n%\n"));
}

TEST(Fanuc30i, TiltsThePlaneWithEulerAnglesAndThenTurnsTheTable) {
  const auto c = test::shipped_controller("fanuc_30i");
  const auto text =
      test::nc_text(c, {nc::ProgramStart{}, nc::TiltedPlane{true, {1000, -2000, 500}, {30000, 45000, -90000}},
                        nc::TiltedPlane{}});
  EXPECT_THAT(text, HasSubstr("N20 G69\nN30 G68.2 X1. Y-2. Z0.5 I30. J45. K-90.\nN40 G53.1\nN50 G69\n"));
}

TEST(Siemens840D, UsesItsOwnWords) {
  const auto text = program("siemens_840d_sl");
  EXPECT_THAT(text, HasSubstr("; made by [us]\nN10 G17 G40 G710 G90 G94\nN20 RTLION\nN30 TRAFOOF\nN40 "
                              "CYCLE800()\nN50 G54\nN60 T4\nN70 M6\nN80 S12000 M3\nN90 D1\n"));
  // Modulo axes: the shorter way to an absolute place.
  EXPECT_THAT(text, HasSubstr(" X1 Y2 Z100 A=DC(330) C=DC(200)\nN110 TRAORI\nN120 ORIMKS\nN130 ORIAXES\n"));
  EXPECT_THAT(text, HasSubstr(" G93 G1 X1 Y2 Z50 C=DC(350) F5\nN150 Y3 C=DC(10) F5\n"));
  EXPECT_THAT(text, HasSubstr(" G4 F1.5\nN170 TRAFOOF\nN180 SUPA G0 Z610 D0\nN190 D1\nN200 TRAORI\n"));
  EXPECT_THAT(
      text,
      HasSubstr(" TRAFOOF\nN250 T5\nN260 M6\nN270 G17 G40 G710 G90 G94\nN280 RTLION\nN290 TRAFOOF\nN300 "
                "CYCLE800()\nN310 G54\nN320 M30\n"));
}

TEST(Siemens840D, AnAxisWithLimitsIsNoModuloAxis) {
  auto c = test::shipped_controller("siemens_840d_sl");
  c.rotary.modulo_axes = nc::AxisWords::bit(nc::AxisLetter::C);
  nc::Motion m = position(nc::MotionKind::rapid, c, {0, 0, 0, -30, -90});
  const std::string text = test::nc_text(c, {nc::ProgramStart{}, m, nc::ProgramEnd{}});
  EXPECT_THAT(text, HasSubstr(" A-30 C=DC(270)\n"));
  const auto back = test::nc_blocks(c, text);
  EXPECT_EQ(std::get<nc::Motion>(back[1]).words[nc::AxisLetter::C], 2700000);
}

// Alarm 16830, or the long way round.
TEST(Siemens840D, ReadsNoPlainWordOfAModuloAxis) {
  const auto c = test::shipped_controller("siemens_840d_sl");
  for (const char* word : {"C90", "C-90", "C=DC(360)", "C=DC(-1)", "C=ACP(90)", "C=IC(5)", "C=DC(90"}) {
    Diagnostics d;
    EXPECT_FALSE(nc::read_program(c, std::string("G90\nG0 X0 ") + word + "\nM30\n", "p.mpf", d)) << word;
  }
  Diagnostics d;
  EXPECT_TRUE(nc::read_program(c, "G90\nG0 X0 c=dc(90.5)\nM30\n", "p.mpf", d));
}

TEST(Siemens840D, SwivelsWithSixteenParameters) {
  const auto c = test::shipped_controller("siemens_840d_sl");
  const auto text = test::nc_text(
      c, {nc::ProgramStart{}, nc::TiltedPlane{true, {10000, 0, 0}, {300000, 0, -50000}}, nc::TiltedPlane{}});
  EXPECT_THAT(text, HasSubstr("CYCLE800(0,\"\",200000,57,1,0,0,30,0,-5,0,0,0,1,0,1)\nN60 CYCLE800()\n"));
  nc::TiltedPlane other{true, {10000, 0, 0}, {300000, 0, -50000}};
  other.direction = -1;
  const auto other_text = test::nc_text(c, {nc::ProgramStart{}, other, nc::ProgramEnd{}});
  EXPECT_THAT(other_text, HasSubstr(",30,0,-5,0,0,0,-1,0,1)\n"));
  EXPECT_EQ(std::get<nc::TiltedPlane>(test::nc_blocks(c, other_text)[1]).direction, -1);
}

TEST(HeidenhainTnc640, SpeaksKlartext) {
  const auto text = program("heidenhain_tnc640");
  EXPECT_THAT(
      text,
      HasSubstr(
          "0 BEGIN PGM PART MM\n1 ; made by [us]\n2 M126\n3 M129\n4 CYCL DEF 7.0 DATUM SHIFT\n5 CYCL DEF "
          "7.1 X+0\n6 CYCL DEF 7.2 Y+0\n7 CYCL DEF 7.3 Z+0\n8 PLANE RESET STAY\n9 CYCL DEF 247 DATUM "
          "SETTING ~\nQ339=+1\n"));
  EXPECT_THAT(
      text,
      HasSubstr("10 TOOL CALL 4 Z\n11 TOOL CALL Z S12000\n12 M3\n13 L X+1 Y+2 Z+100 A-30 C+200 FMAX\n"));
  EXPECT_THAT(text, HasSubstr("14 M128\n15 L X+1 Y+2 Z+50 C+350 F5\n16 L Y+3 C+10\n"));  // C below 360
  EXPECT_THAT(text, HasSubstr("17 CYCL DEF 9.0 DWELL TIME\n18 CYCL DEF 9.1 DWELL 1.5\n"));
  EXPECT_THAT(
      text,
      HasSubstr(
          "19 M129\n20 L Z+610 R0 FMAX M91\n21 M128\n22 L X+1 Y+3 Z+100 FMAX\n23 M129\n24 TOOL CALL 5 Z\n"));
  EXPECT_THAT(text, HasSubstr("24 TOOL CALL 5 Z\n25 M126\n26 M129\n"));
  EXPECT_THAT(text, HasSubstr("31 PLANE RESET STAY\n32 CYCL DEF 247 DATUM SETTING ~\nQ339=+1\n33 M30\n34 END "
                              "PGM PART MM\n"));
}

TEST(HeidenhainTnc640, TiltsThePlaneWithSpatialAngles) {
  const auto c = test::shipped_controller("heidenhain_tnc640");
  const auto text = test::nc_text(
      c, {nc::ProgramStart{}, nc::TiltedPlane{true, {10000, 0, 0}, {300000, 0, -50000}}, nc::TiltedPlane{}});
  EXPECT_THAT(text, HasSubstr("CYCL DEF 7.1 X+1\n"));
  EXPECT_THAT(text, HasSubstr("PLANE SPATIAL SPA+30 SPB+0 SPC-5 TURN FMAX\n"));
  EXPECT_THAT(text, HasSubstr("PLANE RESET STAY\n"));
}

TEST(HaasNgc, GivesFInEveryInverseTimeBlockAndUsesG234) {
  const auto text = program("haas_ngc");
  EXPECT_THAT(text, HasSubstr(" G93 G1 G234 H4 X1. Y2. Z50. C350. F5.\n"));
  EXPECT_THAT(text, HasSubstr(" Y3. C370. F5.\n"));
  EXPECT_THAT(text, HasSubstr(" G4 P1.5\n"));  // with a point: seconds
  EXPECT_THAT(text,
              HasSubstr(" G49\nN100 G53 G0 Z610.\nN110 G0 G234 H4 X1. Y3. Z100.\nN120 G49\nN130 T5 M6\n"));
}

TEST(HaasNgc, DwellsWholeSecondsWithAPoint) {
  const auto text =
      test::nc_text(test::shipped_controller("haas_ngc"), {nc::ProgramStart{}, nc::Dwell{2000}});
  EXPECT_THAT(text, HasSubstr("G4 P2.\n"));  // P2 would be 2 ms
}

TEST(LinuxCnc, WritesFourDecimalsAndTheExactPath) {
  const auto text = program("linuxcnc");
  EXPECT_THAT(text,
              HasSubstr("(made by [us])\nG17 G21 G40 G49 G80 G90 G94\nG61\nG54\nT4 M6\nS12000 M3\nG43 H4\n"));
  EXPECT_THAT(text, HasSubstr("G0 X1.0000 Y2.0000 Z100.0000 A-30.0000 C200.0000\nM428\nG93 G1 X1.0000 "
                              "Y2.0000 Z50.0000 C350.0000 F5.0000\n"));
  EXPECT_THAT(text, HasSubstr("G4 P1.500\nM429\nG53 G0 Z610.0000\nM428\n"));
  EXPECT_THAT(text, HasSubstr("M429\nT5 M6\nG17 G21 G40 G80 G90 G94\nG61\nG54\nM2\n"));
}

// Nothing is known of these, and nothing is made up.
TEST(Hnc8, HasNoWordsForWhatIsNotKnown) {
  const auto c = test::shipped_controller("hnc_8");
  EXPECT_FALSE(c.has_inverse_time());
  EXPECT_FALSE(c.has_tcp());
  EXPECT_FALSE(c.has_tilted_plane());
  EXPECT_TRUE(c.dwell.empty());
  EXPECT_THAT(program("hnc_8"), Not(HasSubstr("G93")));
}

}  // namespace
}  // namespace trunnion
