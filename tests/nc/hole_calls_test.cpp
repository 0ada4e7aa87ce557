// Drilling cycles as others write them: with a safety distance above the surface, called at one place after
// another. What they mean is said in millimetres here, by hand, as the controls' manuals describe the cycles.
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/controllers.hpp"

namespace trunnion::nc {
namespace {

using ::testing::HasSubstr;
constexpr int kSixDecimals = 6;

Result<std::vector<Block>> blocks_of(const std::string& control, const std::string& text, std::string& said) {
  Controller c = test::shipped_controller(control);
  c.numbers.axes = AxisFormat(kSixDecimals, kSixDecimals);
  ReaderOptions options;
  options.others = true;
  Diagnostics diagnostics;
  auto out = read_program(c, text, "p.nc", diagnostics, options);
  for (const auto& finding : diagnostics.findings()) said += finding.text() + "\n";
  return out;
}

double millimetres(std::int64_t quanta) {
  return AxisFormat(kSixDecimals, kSixDecimals).internal(AxisLetter::X, quanta);
}

std::vector<Hole> holes(const std::string& control, const std::string& text) {
  std::string said;
  const auto blocks = blocks_of(control, text, said);
  EXPECT_TRUE(blocks) << said;
  std::vector<Hole> out;
  if (!blocks) return out;
  for (const Block& block : *blocks)
    if (const auto* hole = std::get_if<Hole>(&block)) out.push_back(*hole);
  return out;
}

std::string refused(const std::string& control, const std::string& text) {
  std::string said;
  EXPECT_FALSE(blocks_of(control, text, said)) << text;
  return said;
}

std::string klartext(const std::string& lines) {
  return "BEGIN PGM A MM\nTOOL CALL 1 Z S3000\nM3\nL X+0 Y+0 Z+90 R0 FMAX\n" + lines + "M30\nEND PGM A MM\n";
}

constexpr const char* kDrilling =
    "CYCL DEF 200 BOHREN ~\n Q200=+2 ;SICHERHEITS-ABST. ~\n Q201=-20 ;TIEFE ~\n Q206=+150 ;VORSCHUB TIEFENZ. "
    "~\n Q202=+5 "
    ";ZUSTELL-TIEFE ~\n Q210=+0 ;VERWEILZEIT OBEN ~\n Q203=+10 ;KOOR. OBERFLAECHE ~\n Q204=+50 ;2. "
    "SICHERHEITS-ABST. ~\n "
    "Q211=+0.5 ;VERWEILZEIT UNTEN\n";

// The feed begins 2 mm above the surface at 10 mm; the tool returns to 50 mm above it.
TEST(HoleCalls, AKlartextCycleIsDrilledAtEachPlaceThatCallsIt) {
  const auto found =
      holes("heidenhain_tnc640",
            klartext(std::string(kDrilling) + "L X+10 Y+20 R0 FMAX M99\nL X+30 R0 FMAX M99 ; second\n"
                                              "L Y-5 R0 FMAX\nCYCL CALL\n"));
  ASSERT_EQ(found.size(), 3U);
  const double places[3][2] = {{10, 20}, {30, 20}, {30, -5}};
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Hole& hole = found[i];
    EXPECT_EQ(hole.kind, Hole::Kind::peck);
    EXPECT_DOUBLE_EQ(millimetres(hole.words[AxisLetter::X]), places[i][0]);
    EXPECT_DOUBLE_EQ(millimetres(hole.words[AxisLetter::Y]), places[i][1]);
    EXPECT_DOUBLE_EQ(millimetres(hole.clear), 12.0);
    EXPECT_DOUBLE_EQ(millimetres(hole.bottom), -10.0);
    EXPECT_DOUBLE_EQ(millimetres(hole.step), 5.0);
    EXPECT_DOUBLE_EQ(millimetres(hole.words[AxisLetter::Z]), 60.0);
    EXPECT_EQ(hole.dwell_ms, 500);
  }
  EXPECT_DOUBLE_EQ(millimetres(found[1].from[AxisLetter::Z]), 60.0);
}

// Q204 below Q200 is not used: the tool returns to the set-up clearance.
TEST(HoleCalls, ValuesInOneLineAndASmallSecondClearance) {
  const auto found =
      holes("heidenhain_tnc640",
            klartext("7 CYCL DEF 200 DRILLING Q200=3 Q201=-8 Q206=100 Q202=8 Q210=0 Q203=-1 Q204=0 Q211=0\n"
                     "8 L X+1 Y+2 R0 FMAX M99\n"));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].kind, Hole::Kind::drill);  // the plunging depth is the whole depth
  EXPECT_DOUBLE_EQ(millimetres(found[0].clear), 2.0);
  EXPECT_DOUBLE_EQ(millimetres(found[0].bottom), -9.0);
  EXPECT_DOUBLE_EQ(millimetres(found[0].words[AxisLetter::Z]), 2.0);
}

TEST(HoleCalls, ParametersOfTheProgramStandInTheCycle) {
  const auto found =
      holes("heidenhain_tnc640",
            klartext("Q5 = 4\nCYCL DEF 200 DRILLING ~\nQ200=+Q5 ~\nQ201=-10 ~\nQ206=100 ~\nQ202=0 ~\nQ210=0 "
                     "~\nQ203=0 ~\nQ204=20 ~\nQ211=0\nL X+1 Y+2 R0 FMAX M99\n"));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].kind, Hole::Kind::drill);  // 0: in one stroke
  EXPECT_DOUBLE_EQ(millimetres(found[0].clear), 4.0);
}

// Some posts leave the mark at the end of the line out, and put blanks or tabs in.
TEST(HoleCalls, ParametersInLinesOfTheirOwnBelongToTheCycle) {
  const auto found = holes(
      "heidenhain_tnc640",
      klartext("12 CYCL DEF 200 PERCAGE \n\tQ200=2;DISTANCE\n\tQ201 = -15 ;DEPTH\n; "
               "remark\n\tQ206=250\n\tQ202=15\n"
               "\tQ210=0\n\tQ203=+0\n\tQ204=100\n\tQ211=0.1\n13 FN 0: Q2=+3\n14 L X+1 Y+Q2 R0 FMAX M99\n"));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_DOUBLE_EQ(millimetres(found[0].clear), 2.0);
  EXPECT_DOUBLE_EQ(millimetres(found[0].bottom), -15.0);
  EXPECT_DOUBLE_EQ(millimetres(found[0].words[AxisLetter::Y]), 3.0);
  EXPECT_EQ(found[0].dwell_ms, 100);
}

TEST(HoleCalls, ACycleThatIsNeverCalledIsSaid) {
  std::string said;
  EXPECT_TRUE(blocks_of("heidenhain_tnc640", klartext(kDrilling), said));
  EXPECT_THAT(said, HasSubstr("p.nc:5:1: warning: a drilling cycle that is never called"));
}

TEST(HoleCalls, ReamingComesOutAtTheFeed) {
  std::string said;
  const auto blocks = blocks_of(
      "heidenhain_tnc640",
      klartext("CYCL DEF 201 REAMING ~\nQ200=2 ~\nQ201=-20 ~\nQ206=80 ~\nQ211=0 ~\nQ208=0 ~\nQ203=0 "
               "~\nQ204=30\nL X+1 Y+2 R0 FMAX M99\n"),
      said);
  ASSERT_TRUE(blocks) << said;
  std::vector<std::pair<MotionKind, double>> heights;  // each once
  for (const Block& block : *blocks) {
    const auto* motion = std::get_if<Motion>(&block);
    if (motion != nullptr && motion->words.has(AxisLetter::Z))
      heights.emplace_back(motion->kind, millimetres(motion->words[AxisLetter::Z]));
  }
  heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
  using K = MotionKind;
  EXPECT_EQ(heights, (std::vector<std::pair<K, double>>{
                         {K::rapid, 90}, {K::rapid, 2}, {K::feed, -20}, {K::feed, 2}, {K::rapid, 30}}));
}

TEST(HoleCalls, WhatAKlartextCycleSaysOtherwiseIsRefused) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = kDrilling;
    text.replace(text.find(from), from.size(), to);
    return klartext(text + "L X+1 Y+2 R0 FMAX M99\n");
  };
  const auto says = [&](const std::string& from, const std::string& to) {
    return refused("heidenhain_tnc640", with(from, to));
  };
  EXPECT_THAT(says("Q201=-20", "Q201=+20"), HasSubstr("its bottom is not below the surface"));
  EXPECT_THAT(says("Q200=+2", "Q200=-2"),
              HasSubstr("p.nc:5:1: error: 'CYCL DEF 200': a safety distance below 0"));
  EXPECT_THAT(says("Q210=+0", "Q210=+1"), HasSubstr("Q210 = +1 is not read"));
  EXPECT_THAT(says("Q206=+150", "Q206=FMAX"), HasSubstr("Q206 = 'FMAX' is no number"));
  EXPECT_THAT(says("Q203=+10", "Q303=+10"), HasSubstr("Q303 is not read"));
  EXPECT_THAT(says("Q203=+10", "Q204=+10"), HasSubstr("stands there twice"));
  EXPECT_THAT(refused("heidenhain_tnc640", klartext("L X+1 Y+2 R0 FMAX M99\n")),
              HasSubstr("none that is read stands before it"));
  EXPECT_THAT(refused("heidenhain_tnc640", klartext(std::string(kDrilling) + "CYCL CALL M3\n")),
              HasSubstr("with other words"));
  EXPECT_FALSE(
      refused("heidenhain_tnc640", klartext("CYCL DEF 252 CIRCULAR POCKET ~\nQ215=0\nCYCL CALL\n")).empty());
  EXPECT_FALSE(
      refused("heidenhain_tnc640", klartext(std::string(kDrilling) + "L X+1 Y+2 R0 FMAX M89\n")).empty());
}

std::string sinumerik(const std::string& lines) {
  return "G17 G90 G710 G54\nT1 M6\nD1\nS1000 M3\nG0 X0 Y0 Z90\nG94 F200\n" + lines + "M30\n";
}

// DPR counts from the reference plane, without its sign; SDIS is above it.
TEST(HoleCalls, ASinumerikCycleIsDrilledBehindEveryMotion) {
  for (const char* cycle : {"CYCLE81(50,10,2,-20)", "CYCLE81(50,10,2,,30)", "CYCLE81(50,10,2,-20,30)",
                            "cycle81( 50 , 10 , 2 , -20 )"}) {
    SCOPED_TRACE(cycle);
    const auto found =
        holes("siemens_840d_sl", sinumerik(std::string("N10 MCALL ") + cycle +
                                           "\nN20 X10 Y20\nX=30 ; second\nG0 Y-5\nMCALL\nX100 Y100\n"));
    ASSERT_EQ(found.size(), 3U);
    const double places[3][2] = {{10, 20}, {30, 20}, {30, -5}};
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].kind, Hole::Kind::drill);
      EXPECT_DOUBLE_EQ(millimetres(found[i].words[AxisLetter::X]), places[i][0]);
      EXPECT_DOUBLE_EQ(millimetres(found[i].words[AxisLetter::Y]), places[i][1]);
      EXPECT_DOUBLE_EQ(millimetres(found[i].clear), 12.0);
      EXPECT_DOUBLE_EQ(millimetres(found[i].bottom), -20.0);
      EXPECT_DOUBLE_EQ(millimetres(found[i].words[AxisLetter::Z]), 50.0);
    }
  }
}

TEST(HoleCalls, SinumerikPecksAndTaps) {
  const auto peck = holes("siemens_840d_sl", sinumerik("CYCLE83(50,0,3,-30,,-5,,0,0,0,1,1)\n"));
  ASSERT_EQ(peck.size(), 1U);
  EXPECT_EQ(peck[0].kind, Hole::Kind::peck);
  EXPECT_DOUBLE_EQ(millimetres(peck[0].step), 5.0);
  EXPECT_DOUBLE_EQ(millimetres(peck[0].clear), 3.0);
  const auto short_peck = holes("siemens_840d_sl", sinumerik("CYCLE83(10,0,2,-20,,,5,,,,,1)\n"));
  ASSERT_EQ(short_peck.size(), 1U);
  EXPECT_EQ(short_peck[0].kind, Hole::Kind::peck);
  const auto chips = holes("siemens_840d_sl", sinumerik("CYCLE83(50,0,3,-30,,,5,0,0,0,1,0)\n"));
  ASSERT_EQ(chips.size(), 1U);
  EXPECT_EQ(chips[0].kind, Hole::Kind::chip_break);
  const auto tap = holes("siemens_840d_sl", sinumerik("CYCLE84(50,0,4,-15,,,5,,1.25,0,500,0)\n"));
  ASSERT_EQ(tap.size(), 1U);
  EXPECT_EQ(tap[0].kind, Hole::Kind::tap);
  EXPECT_EQ(tap[0].thread.rpm, 500);
  EXPECT_DOUBLE_EQ(millimetres(tap[0].clear), 4.0);
  const auto bore = holes("siemens_840d_sl", sinumerik("CYCLE85(50,0,4,-15,,0.3,120,120)\n"));
  ASSERT_EQ(bore.size(), 1U);
  EXPECT_EQ(bore[0].kind, Hole::Kind::feed_out);
  EXPECT_EQ(bore[0].dwell_ms, 300);
}

TEST(HoleCalls, WhatASinumerikCycleSaysOtherwiseIsRefused) {
  const auto says = [](const std::string& lines) { return refused("siemens_840d_sl", sinumerik(lines)); };
  EXPECT_THAT(says("CYCLE81(50,10,2,-20,25)\n"), HasSubstr("its depth is said twice, and not the same"));
  EXPECT_THAT(says("CYCLE81(5,10,2,-20)\n"), HasSubstr("returns below"));
  EXPECT_THAT(says("CYCLE81(50,10,2)\n"), HasSubstr("without its depth"));
  EXPECT_THAT(says("CYCLE81(50,10,2,-20,,0,0,1,11)\n"), HasSubstr("is not read"));
  EXPECT_THAT(says("CYCLE81(50,10,2,-20,,0,0,0,0,0)\n"), HasSubstr("is not read"));
  EXPECT_THAT(says("CYCLE83(50,0,3,-30,,,5,1,0,0,1,1)\n"), HasSubstr("is not read"));
  EXPECT_THAT(says("CYCLE83(50,0,3,-30,,,5,0,0,0,0.5,1)\n"), HasSubstr("is not read"));
  EXPECT_THAT(says("CYCLE85(50,0,4,-15,,0,120,300)\n"), HasSubstr("another feed"));
  EXPECT_THAT(says("CYCLE81(50,10,2,-20) M8\n"), HasSubstr("in a line of its own"));
  EXPECT_THAT(says("MCALL CYCLE81(50,10,2,-20)\nX10 Z5\n"), HasSubstr("under 'MCALL'"));
  EXPECT_THAT(says("MCALL CYCLE81(50,10,2,-20)\nTRANS X10\n"), HasSubstr("under 'MCALL'"));
  EXPECT_THAT(says("MCALL CYCLE81(50,10,2,-20)\nC90\n"), HasSubstr("under 'MCALL'"));
  EXPECT_THAT(says("MCALL POCKET3(50)\n"), HasSubstr("no drilling cycle"));
  EXPECT_THAT(says("MCALL CYCLE81(50,10,2,-20)\nCYCLE81(50,10,2,-20)\n"), HasSubstr("under 'MCALL'"));
}

TEST(HoleCalls, AWordThatStandsForTwo) {
  std::string said;
  const auto blocks =
      blocks_of("heidenhain_tnc640",
                "BEGIN PGM A MM\nTOOL CALL 1 Z S3000\nL X+0 Y+0 Z+90 R0 FMAX M13\nM30\nEND PGM A MM\n", said);
  ASSERT_TRUE(blocks) << said;
  bool turns = false, cools = false;
  for (const Block& block : *blocks) {
    if (const auto* spindle = std::get_if<Spindle>(&block))
      turns = spindle->turn == SpindleTurn::clockwise && spindle->rpm == 3000;
    if (const auto* coolant = std::get_if<Coolant>(&block)) cools = coolant->kind == CoolantKind::flood;
  }
  EXPECT_TRUE(turns);
  EXPECT_TRUE(cools);
}

// P of a Haas without its point is in milliseconds.
TEST(HoleCalls, DwellsInBothSpellings) {
  const auto dwell = [](const std::string& control, const std::string& words) {
    std::string said;
    const auto blocks = blocks_of(control, "G21 G90\nG0 X1. Y1. Z1.\n" + words + "\nM30\n", said);
    EXPECT_TRUE(blocks) << said;
    std::int64_t out = -1;
    if (!blocks) return out;
    for (const Block& block : *blocks)
      if (const auto* found = std::get_if<Dwell>(&block)) out = found->milliseconds;
    return out;
  };
  EXPECT_EQ(dwell("fanuc_30i", "G4 X1.5"), 1500);
  EXPECT_EQ(dwell("fanuc_30i", "G4 P500"), 500);
  EXPECT_EQ(dwell("haas_ngc", "G4 P0.5"), 500);
  EXPECT_EQ(dwell("haas_ngc", "G4 P500"), 500);
  EXPECT_EQ(dwell("linuxcnc", "G4 P2"), 2000);
}

// They vanished without a word: a way out, a hole.
TEST(HoleCalls, WhatFollowsATildeSetsAValue) {
  for (const char* line : {"L Z+100 R0 FMAX", "41 L Z+100 R0 FMAX", "CYCL CALL", "M5"})
    EXPECT_THAT(
        refused("heidenhain_tnc640",
                klartext("CYCL DEF 201 REAMING ~\nQ200=2 ~\n" + std::string(line) +
                         "\nQ201=-20 ~\nQ206=80 ~\nQ211=0 ~\nQ208=0 ~\nQ203=0 ~\nQ204=30\nCYCL CALL\n")),
        HasSubstr("behind '~'"))
        << line;
}

}  // namespace
}  // namespace trunnion::nc
