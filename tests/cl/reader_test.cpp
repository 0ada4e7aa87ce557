#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <string>

#include "trunnion/base/number_text.hpp"

#include "cl/support.hpp"

namespace trunnion::cl {
namespace {

using test::joined;
using test::read;
using test::Reading;

Vec3 tip(const Reading& reading, std::size_t index) {
  return reading.motions().at(index).tip_P;
}
Vec3 axis(const Reading& reading, std::size_t index) {
  return reading.motions().at(index).axis_P;
}

TEST(Reader, AGotoOfSixValuesIsAMotion) {
  const auto reading = read("GOTO/1.5,-2.25,3,0.6,0,0.8\n");
  ASSERT_EQ(reading.motions().size(), 1U);
  EXPECT_EQ(tip(reading, 0), Vec3(1.5, -2.25, 3.0));
  EXPECT_NEAR((axis(reading, 0) - Vec3(0.6, 0.0, 0.8)).norm(), 0.0, 1e-15);
  EXPECT_FALSE(reading.motions()[0].rapid);
  EXPECT_EQ(reading.motions()[0].feed.mode, FeedMode::none);
  EXPECT_EQ(reading.records[0].where, (SourceRef{1, 1}));
  EXPECT_TRUE(reading.findings.empty());
}

// The same two points in every way of writing that the dialects use.
TEST(Reader, EveryLayoutOfAStatementReadsTheSame) {
  for (const std::string text : {
           "GOTO/1.5,-0.5,25,0.6,0,0.8\nGOTO/1.5,-0.5,26,0.6,0,0.8\n",
           "GOTO/1.5,-.5,25.,.6,0,.8\nGOTO/+1.5,-.5,26.\n",
           "GOTO  /   1.50000,   -0.50000,   25.00000, 0.6,0.0,0.8\r\nGOTO  /   1.50000,   -0.50000,   "
           "26.00000\r\n",
           "goto/1.5,-0.5,25,0.6,0,0.8\nGoto/1.5,-0.5,26.0",
           "GOTO / 1.5, -0.5, 25.0,  $\n0.6, 0.0, 0.8\nGOTO / 1.5, $\n -0.5, 26 $\n, 0.6, 0, 0.8\n",
           "\tGOTO\t/1.5\t,-0.5,25,0.6,0,0.8 $$ a comment\n\n$$ another\n  GO TO /1.5,-0.5,26 $$ the end",
           "GOTO/1.5,-0.5,25 $ what follows a dollar is no data\n,0.6,0,0.8\nGOTO/1.5,-0.5,26,0.6,0,0.8 $$\n",
           "GOTO/1.5,-5e-1,2.5E1,0.6,0,8.0D-1\nGOTO/15.e-1,-0.5,26\n",
           "GOTO/1.5,- 0.5,25,0.6,0,0.8\nGOTO/1.5,-0.5,+ 26\n",
           "\xEF\xBB\xBFGOTO/1.5,-0.5,25,0.6,0,0.8\nGOTO/1.5,-0.5,26\x1A",
           "GOTO/1.5,$\n$$ a comment between\n-0.5,25,0.6,0,0.8\nGOTO/1.5,-0.5,26.0",
       }) {
    const auto reading = read(text);
    ASSERT_EQ(reading.motions().size(), 2U) << text << joined(reading.findings);
    EXPECT_TRUE(reading.findings.empty()) << text << joined(reading.findings);
    EXPECT_EQ(tip(reading, 0), Vec3(1.5, -0.5, 25.0)) << text;
    EXPECT_EQ(tip(reading, 1), Vec3(1.5, -0.5, 26.0)) << text;
    EXPECT_EQ(axis(reading, 0), axis(reading, 1)) << text;
    EXPECT_NEAR((axis(reading, 0) - Vec3(0.6, 0.0, 0.8)).norm(), 0.0, 1e-15) << text;
  }
}

TEST(Reader, ABlankInsideANumberIsReadOverWithAWarning) {
  const auto reading = read("GOTO/-24.5855,-1 15.0000,100\n");
  EXPECT_EQ(joined(reading.findings), "1:15: warning: GOTO: blank inside a number, read as -115.0000\n");
  EXPECT_EQ(tip(reading, 0), Vec3(-24.5855, -115.0, 100.0));
}

// MACHIN/UNCX01,1 $ / UNITS/INCHES: a part in inches was read in mm, without a word.
TEST(Reader, NoStatementIsSwallowedByTheOneBefore) {
  const std::string points = "GOTO/1,2,3\nGOTO/4,5,6\n";
  for (const char* next :
       {"UNITS/INCHES", "RAPID", "GODLTA/0,0,7", "  Loadtl /5", "FEDRAT/100,MMPM", "GOHOME"}) {
    const auto reading = read("GOTO/0,0,9\nTMARK/5 $\n" + std::string(next) + "\n" + points);
    EXPECT_THAT(joined(reading.findings),
                ::testing::HasSubstr("2:9: warning: continued by $, but the next line is a new "
                                     "statement"))
        << next;
    const auto alone = read("GOTO/0,0,9\nTMARK/5\n" + std::string(next) + "\n" + points);
    EXPECT_EQ(reading.records.size(), alone.records.size()) << next;
  }
  // More comes, or a value that is no statement.
  for (const char* whole : {"LOADTL/5, $\nLENGTH,100", "CYCLE/DRILL,MMPM,100,CLEAR,5, $\nDEPTH,3\nCYCLE/OFF"})
    EXPECT_EQ(joined(read(std::string(whole) + "\n" + points).findings), "") << whole;
  for (const char* lost : {"PAINT/COLOR,211GOTO/40,0,60", "CUTCOM/OFF,GOTO/15,5,50", "DISPLY/ONGOTO/15,5,50",
                           "RAPID,GOTO/0,0,60", "MACHIN/A,1UNITS/INCHES", "SYN/'A','$$'GOTO/15,5,50",
                           "TMARK/5RAPID", "TOOL PATH/AGOTO/15,5,50"})
    EXPECT_THAT(joined(read("GOTO/0,0,9\n" + std::string(lost) + "\n" + points).findings),
                ::testing::HasSubstr("a second statement in the line"))
        << lost;
  // Text, units and names of others.
  for (const char* fine : {"PPRINT SEE GOTO/1,2,3", "INSERT G1 X1 (GOTO/)", "FEDRAT/100,MMPM", "PAINT/PATH",
                           "MACHIN/POST/A,1", "SYN/'A','GOTO/1'", "TOOLNAME/BALLHEAD/10", "PPFILE/MYCOPY/1"})
    EXPECT_THAT(joined(read("GOTO/0,0,9\n" + std::string(fine) + "\n" + points).findings),
                ::testing::Not(::testing::HasSubstr("a second statement")))
        << fine;
}

TEST(Reader, AFileThatEndsWithinALineIsSaid) {
  EXPECT_EQ(joined(read("LOADTL/1\nGOTO/1,2,3\nGOTO/20,5,2").findings),
            "3: warning: the file ends in a line without an end: is its last number, 2, whole?\n");
  // Points alone, as a real file of an impeller has them.
  EXPECT_EQ(joined(read("GOTO/1,2,3\nGOTO/20,5,2").findings), "");
  EXPECT_EQ(joined(read("GOTO/1,2,3\nGOTO/20,5,2\n").findings), "");
}

TEST(Reader, AContinuationThatIsMissingEndsTheStatementWithAWarning) {
  const auto reading = read("GOTO/1,2,3,1,0,0\nGOTO/4,5,6, $\n  goto /7,8,9,0,0,1\n");
  EXPECT_EQ(joined(reading.findings),
            "2:13: warning: continued by $, but the next line is a new GOTO: the statement is taken as it "
            "stands\n");
  ASSERT_EQ(reading.motions().size(), 3U);
  EXPECT_EQ(tip(reading, 1), Vec3(4, 5, 6));
  EXPECT_EQ(axis(reading, 1), Vec3(1, 0, 0));
  EXPECT_EQ(tip(reading, 2), Vec3(7, 8, 9));
  EXPECT_EQ(reading.records[2].where, (SourceRef{3, 3}));
  EXPECT_EQ(
      joined(read("GOTO/1,2,3\nGOTO/4,5, $\nGOTO/7,8,9\n").findings),
      "2:11: warning: continued by $, but the next line is a new GOTO: the statement is taken as it stands\n"
      "2:1: error: GOTO: 2 values; 3 (x, y, z) or 6 (x, y, z, i, j, k) are needed\n");
}

TEST(Reader, PlacesAreThoseOfThePhysicalLine) {
  const auto reading = read("GOTO/0,0,0\n\n  GOTO / 1, $\n   2, $\n x3\n");
  EXPECT_EQ(joined(reading.findings), "5:2: error: GOTO: 'X3' is not a number\n");
}

TEST(Reader, TheAxisIsModalAndStartsAtZ) {
  const auto reading =
      read("GOTO/0,0,0\nGOTO/0,0,1,1,0,0\nGOTO/0,0,2\nTLAXIS/0,1,0\nGOTO/0,0,3\nGODLTA/0,0,1\n");
  EXPECT_EQ(axis(reading, 0), Vec3(0, 0, 1));
  EXPECT_EQ(axis(reading, 2), Vec3(1, 0, 0));
  EXPECT_EQ(axis(reading, 3), Vec3(0, 1, 0));
  EXPECT_EQ(axis(reading, 4), Vec3(0, 1, 0));
}

TEST(Reader, GodltaGoesOnFromTheLastPosition) {
  const auto reading = read("FROM/10,20,30\nGODLTA/1,0,0\nGODLTA/0,1,0,0,1,0\nGOTO/0,0,0\nGODLTA/0,0,-1\n");
  EXPECT_EQ(tip(reading, 0), Vec3(11, 20, 30));
  EXPECT_EQ(tip(reading, 1), Vec3(11, 21, 30));
  EXPECT_EQ(axis(reading, 1), Vec3(0, 1, 0));
  EXPECT_EQ(tip(reading, 3), Vec3(0, 0, -1));
  ASSERT_EQ(reading.all<From>().size(), 1U);
  EXPECT_EQ(reading.all<From>()[0].tip_P, Vec3(10, 20, 30));
}

TEST(Reader, RapidIsForTheNextMotionOnlyAndFeedIsModal) {
  const auto reading =
      read("RAPID\nFROM/0,0,9\nGOTO/0,0,1\nFEDRAT/600,MMPM\nGOTO/0,0,2\nRAPID/\nGODLTA/0,0,1\nGOTO/0,0,4\n");
  const auto motions = reading.motions();
  ASSERT_EQ(motions.size(), 4U);
  EXPECT_TRUE(motions[0].rapid);
  EXPECT_FALSE(motions[1].rapid);
  EXPECT_TRUE(motions[2].rapid);
  EXPECT_FALSE(motions[3].rapid);
  EXPECT_EQ(motions[3].feed, (Feed{FeedMode::per_minute, 10.0}));
}

TEST(Reader, FeedsInEveryOrderAndUnit) {
  struct Case {
    std::string text;
    FeedMode mode;
    double value;
  };
  const Case cases[] = {
      {"FEDRAT/120", FeedMode::per_minute, 2.0},
      {"FEDRAT/120,MMPM", FeedMode::per_minute, 2.0},
      {"FEDRAT/MMPM,120.", FeedMode::per_minute, 2.0},
      {"FEDRAT / 10,  IPM", FeedMode::per_minute, 254.0 / 60.0},
      {"FEDRAT/FPM,1", FeedMode::per_minute, 304.8 / 60.0},
      {"FEDRAT/120,PERMIN", FeedMode::per_minute, 2.0},
      {"UNITS/INCHES\nFEDRAT/60,PERMIN", FeedMode::per_minute, 25.4},
      {"UNITS/INCHES\nFEDRAT/60", FeedMode::per_minute, 25.4},
      {"UNITS/INCHES\nFEDRAT/120,MMPM", FeedMode::per_minute, 2.0},
      {"FEDRAT/    0.1000,MMPR", FeedMode::per_revolution, 0.1},
      {"FEDRAT/IPR,0.01", FeedMode::per_revolution, 0.254},
      {"FEDRAT/0.2,PERREV", FeedMode::per_revolution, 0.2},
      {"UNIT/INCHES\nFEDRAT/PERREV,0.01", FeedMode::per_revolution, 0.254},
      {"FEDRAT/INVERS,30", FeedMode::inverse, 0.5},
  };
  for (const Case& each : cases) {
    const auto reading = read(each.text + "\nGOTO/0,0,0\n");
    ASSERT_TRUE(reading.findings.empty()) << each.text << joined(reading.findings);
    EXPECT_EQ(reading.motions()[0].feed.mode, each.mode) << each.text;
    EXPECT_NEAR(reading.motions()[0].feed.value, each.value, 1e-14 * each.value) << each.text;
  }
}

// The seventh number of CUTTER is how far it cuts up from its tip.
TEST(Reader, CutterHasAFlute) {
  const auto cutters =
      read("UNITS/INCHES\nCUTTER/1,.1,.4,.1,0,0,2\nCUTTER/1,.1,.4,.1,0,0,0\nCUTTER/1\n").all<ToolGeometry>();
  ASSERT_EQ(cutters.size(), 3U);
  EXPECT_DOUBLE_EQ(*cutters[0].flute_length_mm, 50.8);
  EXPECT_FALSE(cutters[1].flute_length_mm);
  EXPECT_FALSE(cutters[2].flute_length_mm);
  EXPECT_EQ(joined(read("UNITS/MM\nCUTTER/10,5,0,5,0,0,-25\n").findings),
            "2:1: error: CUTTER: a height of -25 mm; the seventh number is how far the cutter cuts up from "
            "its tip\n");
}

TEST(Reader, InchesScaleLengthsAndNotTheAxis) {
  const auto reading =
      read("UNITS / INCHES\nCUTTER/1,.125\nGOTO/1,2,-0.5,1,0,0\nGODLTA/1,0,0\nLINTOL/.001\n");
  EXPECT_EQ(tip(reading, 0), Vec3(25.4, 50.8, -12.7));
  EXPECT_EQ(tip(reading, 1), Vec3(50.8, 50.8, -12.7));
  EXPECT_EQ(axis(reading, 0), Vec3(1, 0, 0));
  EXPECT_DOUBLE_EQ(*reading.all<ToolGeometry>().at(0).diameter_mm, 25.4);
  EXPECT_DOUBLE_EQ(*reading.all<ToolGeometry>().at(0).corner_radius_mm, 3.175);
  EXPECT_DOUBLE_EQ(*reading.all<Tolerance>().at(0).value_mm, 0.0254);
  ReaderOptions inch;
  inch.units = ReaderOptions::Units::inch;
  EXPECT_EQ(tip(read("GOTO/1,0,0\n", inch), 0), Vec3(25.4, 0, 0));
  EXPECT_EQ(tip(read("UNITS/MM\nGOTO/1,0,0\n", inch), 0), Vec3(1, 0, 0));
}

TEST(Reader, AnAxisThatIsNearlyUnitIsNormalisedWithOneWarning) {
  const auto rounded = read("GOTO/0,0,0,0.8259,-0.0720,0.5592\n");  // four decimals
  EXPECT_TRUE(rounded.findings.empty());
  EXPECT_DOUBLE_EQ(axis(rounded, 0).norm(), 1.0);
  const auto off = read("GOTO/0,0,0,0.0694,0,0.99960\nGOTO/0,0,1,0.0694,0,0.99960\n");  // norm 1.0020
  EXPECT_EQ(joined(off.findings),
            "1:12: warning: GOTO: the tool axis has length 1.0020 and was normalised\n"
            "1:12: note: 2 tool axes were normalised; the length of this one is off by most, 0.00201\n");
  EXPECT_DOUBLE_EQ(axis(off, 0).norm(), 1.0);
  EXPECT_EQ(axis(off, 0), axis(off, 1));
}

TEST(Reader, TheResolutionIsHalfOfTheLastDecimal) {
  const auto nx = read("GOTO/0.0000,222.6719,-177.5,0.0,0.0000000,-1.0\n");
  EXPECT_DOUBLE_EQ(nx.resolution.coordinate_mm, 0.5e-4);
  EXPECT_DOUBLE_EQ(nx.resolution.axis, 0.5e-7);
  EXPECT_DOUBLE_EQ(read("UNITS/INCHES\nGOTO/0.001,0,0\n").resolution.coordinate_mm, 0.0127);
  EXPECT_EQ(read("GOTO/0.001,0,0,0,0,1\n").resolution.axis, 0.0);
  EXPECT_EQ(read("GOTO/1,2,3,0.6,0,0.8\n").resolution.axis, 0.0);
  EXPECT_DOUBLE_EQ(read("GOTO/1,2,3,0.6,1.25e-3,0.8\n").resolution.axis, 0.5e-5);
}

TEST(Reader, NumbersAreRoundedCorrectlyHoweverLong) {
  for (const std::string number :
       {"140.9830392719", "0.1", "0.3", "123456789012345678e-17", "9007199254740993e-13",
        "0.123456789012345678901234567890", "00000000000000000000001.5", "999.99999999999999999",
        "0.1000000000000000055511151231257827021181583404541015625", "1.7976931348623157"}) {
    const auto reading = read("GOTO/" + number + ",-" + number + ",0\n");
    ASSERT_EQ(reading.motions().size(), 1U) << number << joined(reading.findings);
    EXPECT_EQ(tip(reading, 0).x(), std::stod(number)) << number;
    EXPECT_EQ(tip(reading, 0).y(), -std::stod(number)) << number;
  }
}

// x_P = y_A - 20, y_P = x_A - 10, z_P = -(z_A - 30)
constexpr char kMsys[] = "MSYS/10,20,30,0,1,0,1,0,0\n";

TEST(Reader, MsysIsAppliedToPointsOfTheAbsoluteSystem) {
  const std::string text =
      std::string(kMsys) + "GOTO/12,23,34,0,0,-1\nGODLTA/0,1,0\n";  // from below in A, from above in MSYS
  const auto applied = read(text);
  EXPECT_EQ(joined(applied.findings),
            "1:1: note: MSYS is applied: the points are in the absolute system (in it the tool axis points "
            "down)\n");
  EXPECT_NEAR((tip(applied, 0) - Vec3(3, 2, -4)).norm(), 0.0, 1e-13);
  EXPECT_NEAR((tip(applied, 1) - Vec3(4, 2, -4)).norm(), 0.0, 1e-13);
  EXPECT_EQ(axis(applied, 0), Vec3(0, 0, 1));
  ASSERT_EQ(applied.all<Frame>().size(), 1U);
  EXPECT_TRUE(applied.all<Frame>()[0].applied);
  ReaderOptions ignore = test::in_mm();
  ignore.frames = ReaderOptions::Frames::ignore;
  const auto ignored = read(text, ignore);
  EXPECT_EQ(tip(ignored, 0), Vec3(12, 23, 34));
  EXPECT_FALSE(ignored.all<Frame>()[0].applied);
}

TEST(Reader, PointsOfMsysStandAsTheyAre) {
  const auto reading = read(std::string(kMsys) + "GOTO/12,23,34,0,0,1\n");
  EXPECT_EQ(joined(reading.findings), "1:1: note: MSYS: the points are taken as given in it\n");
  EXPECT_EQ(tip(reading, 0), Vec3(12, 23, 34));
  ReaderOptions apply = test::in_mm();
  apply.frames = ReaderOptions::Frames::apply;
  EXPECT_NEAR((tip(read(std::string(kMsys) + "GOTO/12,23,34,0,0,1\n", apply), 0) - Vec3(3, 2, -4)).norm(),
              0.0, 1e-13);
}

TEST(Reader, AProgramIsInItsFirstMsys) {
  const std::string second = "MSYS/0,0,0,1,0,0,0,1,0\nGOTO/12,23,34,0,0,-1\n";
  // In the first, absolute: the same point again. In MSYS: the point of the second frame, seen in the first.
  const auto absolute = read(std::string(kMsys) + "GOTO/12,23,34,0,0,-1\n" + second);
  EXPECT_EQ(
      absolute.findings.at(1),
      "3:1: warning: this MSYS differs from the program's first one: all points are given in the first");
  EXPECT_EQ(tip(absolute, 0), tip(absolute, 1));
  const auto given = read(std::string(kMsys) + "GOTO/12,23,34,0,0,1\n" + second);
  EXPECT_NEAR((tip(given, 1) - Vec3(3, 2, -4)).norm(), 0.0, 1e-13);
  const auto back =
      read(std::string(kMsys) + "GOTO/12,23,34,0,0,1\n" + second + kMsys + "GODLTA/0,0,1\nGOTO/12,23,34\n");
  EXPECT_NEAR((tip(back, 2) - Vec3(3, 2, -3)).norm(), 0.0, 1e-13);
  EXPECT_NEAR((tip(back, 3) - Vec3(12, 23, 34)).norm(), 0.0, 1e-13);
  EXPECT_EQ(joined(read("GOTO/0,0,0\n" + second).findings),
            "2:1: error: MSYS after the first motion: in which frame were the points before it?\n");
}

// The number of a card, or of the line, is no digit of the last value.
TEST(Reader, DigitsFarApartAreNoNumber) {
  const auto reading = read("GOTO/10.,20.,5." + std::string(50, ' ') + "120\n");
  EXPECT_NE(joined(reading.findings).find("error: GOTO: digits far apart, 5.120 if they are one number"),
            std::string::npos)
      << joined(reading.findings);
}

// What stands in LOADTL without a word, in TOOLNO, or as a frame of an unknown name does not vanish.
TEST(Reader, NumbersOfToolsAndFramesDoNotVanish) {
  const auto says = [](const std::string& line) { return joined(read(line + "\nGOTO/1,2,3\n").findings); };
  EXPECT_NE(says("LOADTL/3,120").find("120 stands there without a word"), std::string::npos);
  EXPECT_EQ(says("LOADTL/3,ADJUST,7,LENGTH,120"), "");
  EXPECT_NE(says("TOOLNO/3,MILL,OSETNO,5").find("OSETNO,5 is not read"), std::string::npos);
  EXPECT_NE(says("WORKPLANE/1,0,0,0,1,0,0,0,1,5,6,7").find("12 numbers may be a frame"), std::string::npos);
  EXPECT_NE(says("CSYS/1,0,0,5,0,1,0,0,0,0,1,0").find("CSYS is not the identity"), std::string::npos);
  const auto five = read("LOADTL/3, 0, 40., 7, 8\nGOTO/1,2,3\n");
  for (const Record& record : five.records) {
    if (const auto* tool = std::get_if<ToolChange>(&record.data)) {
      EXPECT_EQ(tool->length_register, 7U);
    }
  }
}

// The kind of feed is modal (NCCS PostWorks, fedrat.f).
TEST(Reader, AFeedWithoutAUnitIsOfTheKindBefore) {
  for (const auto& [line, mode] : {std::pair{"FEDRAT/0.2,MMPR", FeedMode::per_revolution},
                                   std::pair{"FEDRAT/30,INVERS", FeedMode::inverse},
                                   std::pair{"FEDRAT/30,MMPM", FeedMode::per_minute}}) {
    const auto reading = read(std::string(line) + "\nGOTO/0,0,0\nFEDRAT/0.3\nGOTO/1,2,3\n");
    const auto* motion = std::get_if<Motion>(&reading.records.back().data);
    ASSERT_NE(motion, nullptr) << line;
    EXPECT_EQ(motion->feed.mode, mode) << line;
    EXPECT_EQ(joined(reading.findings).find("taken as the feed before it") != std::string::npos,
              mode != FeedMode::per_minute);
  }
}

TEST(Reader, AFeedPerMinuteIsNoneOfATurn) {
  EXPECT_NE(joined(read("FEDRAT/0.2,MMPR\nGOTO/0,0,0\nFEDRAT/800\nGOTO/1,2,3\n").findings)
                .find("800 in a turn is no feed"),
            std::string::npos);
}

TEST(Reader, ATiltedCsysNeedsTheAxisInEachPoint) {
  const std::string csys =
      "TRNTYP/WORLD,0,0,0\nCSYS/0,-0.984808,-0.173648,0,1.,0,0,0,0,-0.173648,.984808,0\n";
  EXPECT_EQ(joined(read(csys + "GOTO/1,2,3\n").findings),
            "3:1: error: GOTO without a tool axis under a tilted CSYS: the last axis or that of the CSYS?\n");
  const auto reading = read(csys + "GOTO/1,2,3,-0.173648,0,.984808\nGOTO/1,2,4\n");
  EXPECT_TRUE(reading.findings.empty()) << joined(reading.findings);
  EXPECT_EQ(tip(reading, 1), Vec3(1, 2, 4));
  EXPECT_EQ(joined(read("TRNTYP/LOCAL,0,0,0\nGOTO/1,2,3\n").findings),
            "1:1: error: TRNTYP: only TRNTYP/WORLD,0,0,0 is understood\n");
}

TEST(Reader, TextWordsKeepTheRestOfTheLine) {
  const auto reading = read(
      "PARTNO / MFG0001\nPPRINTN101= Drill, $$ 5 mm $\nINSERT/[HOLDER=C40] 16MM CRB\nPARTNODOOR_1\nPPRINT "
      "it's\n"
      "GOTO/0,0,0\nTOOL PATH/VARIABLE_CONTOUR,TOOL,BPR\nEND-OF-PATH\n");
  EXPECT_TRUE(reading.findings.empty()) << joined(reading.findings);
  const auto texts = reading.all<Text>();
  ASSERT_EQ(texts.size(), 5U);
  EXPECT_EQ(texts[0].text, "MFG0001");
  EXPECT_EQ(texts[1].text, "N101= Drill, $$ 5 mm $");
  EXPECT_EQ(texts[2].text, "[HOLDER=C40] 16MM CRB");
  EXPECT_EQ(texts[3].text, "DOOR_1");
  EXPECT_EQ(texts[4].text, "it's");
  EXPECT_EQ(texts[2].kind, Text::Kind::insert);
  EXPECT_EQ(reading.all<OperationBegin>().at(0).name, "VARIABLE_CONTOUR");
  EXPECT_EQ(reading.all<OperationEnd>().size(), 1U);
}

TEST(Reader, SpindleInAnyOrder) {
  for (const std::string text :
       {"SPINDL/RPM,800,CLW", "SPINDL/800,RPM,CLW", "SPINDL/CLW,800", "SPINDL / RPM, 800.0,  CLW"}) {
    const auto spindle = read(text + "\nGOTO/0,0,0\n").all<Spindle>().at(0);
    EXPECT_EQ(spindle.speed_rpm, 800.0) << text;
    EXPECT_FALSE(spindle.counterclockwise);
  }
  const auto surface =
      read("MODE/MILL\nSPINDL/  60.0,SMM, CCLW,MAXRPM,2000\nSPINDL/OFF\nSPINDL/ON\nGOTO/0,0,0\n")
          .all<Spindle>();
  EXPECT_DOUBLE_EQ(*surface.at(0).surface_speed_mm_s, 1000.0);
  EXPECT_EQ(surface.at(0).max_rpm, 2000.0);
  EXPECT_FALSE(surface.at(0).speed_rpm);
  EXPECT_TRUE(surface.at(0).counterclockwise);
  EXPECT_EQ(surface.at(1).state, Spindle::State::off);
  EXPECT_EQ(surface.at(2).state, Spindle::State::on);
  EXPECT_FALSE(surface.at(2).speed_rpm);
}

// The sense that was said last holds where none is said, but not for another tool where it was to the left.
TEST(Reader, TheSenseOfTheSpindleHolds) {
  const auto senses = [](const std::string& text) {
    std::string out;
    const auto reading = read(text + "GOTO/0,0,0\n");
    for (const Spindle& s : reading.all<Spindle>())
      out += s.state == Spindle::State::off ? '0' : s.counterclockwise ? 'L' : 'R';
    return out + joined(reading.findings);
  };
  EXPECT_EQ(senses("SPINDL/8000,CCLW\nSPINDL/OFF\nSPINDL/ON\nSPINDL/5000\nSPINDL/4000,CLW\nSPINDL/ON\n"),
            "L0LLRR");
  EXPECT_EQ(senses("SPINDL/8000,RPM,CCW\nSPINDL/RPM,900,CW\n"), "LR");
  EXPECT_EQ(senses("LOADTL/1\nSPINDL/8000\nLOADTL/2\nSPINDL/5000\nLOADTL/3\nSPINDL/CCLW,700\n"), "RRL");
  const std::string open =
      "error: SPINDL says neither CLW nor CCLW, and the tool before turned counterclockwise: say which way "
      "this one turns\n";
  EXPECT_EQ(senses("LOADTL/1\nSPINDL/8000,CCLW\nLOADTL/2\nSPINDL/OFF\nSPINDL/5000\n"), "L05:1: " + open);
  EXPECT_EQ(senses("LOADTL/1\nSPINDL/8000,CCLW\nLOADTL/2\nSPINDL/CLW\nSPINDL/5000\n"), "LRR");
  EXPECT_EQ(senses("LOADTL/1\nSPINDL/8000,CCLW\nLOADTL/1\nSPINDL/5000\n"), "LL");
}

TEST(Reader, AWordThatIsSkippedStartsNothing) {
  const auto said = [](const std::string& text) {
    const auto reading = read(text + "\nGOTO/0,0,0\n");
    std::string out;
    for (const Spindle& s : reading.all<Spindle>())
      out += s.state == Spindle::State::off ? "off " : shortest_text(s.speed_rpm.value_or(0.0)) + ' ';
    for (const Coolant& c : reading.all<Coolant>()) out += std::to_string(static_cast<int>(c.kind)) + ' ';
    return out + joined(reading.findings);
  };
  for (const std::string word : {"LOCK", "NEUTRL", "STOP", "OFF"}) EXPECT_EQ(said("SPINDL/" + word), "off ");
  EXPECT_EQ(said("SPINDL/RANGE,2,RPM,8000,CLW"),
            "8000 1:8: warning: SPINDL: RANGE is not known and was skipped, with a number behind it\n");
  EXPECT_EQ(said("SPINDL/GEAR,2"),
            "1:8: warning: SPINDL: GEAR is not known and was skipped, with a number behind it\n"
            "1:8: error: SPINDL/GEAR is not known, and the statement says nothing else: whether the spindle "
            "turns is not clear\n");
  const std::string flood = std::to_string(static_cast<int>(Coolant::Kind::flood)) + ' ';
  const std::string through = std::to_string(static_cast<int>(Coolant::Kind::through)) + ' ';
  EXPECT_EQ(said("COOLNT/FLOOD\nCOOLNT/NOMORE"), flood + "0 ");
  EXPECT_EQ(said("COOLNT/THRU\nCOOLNT/OFF\nCOOLNT/ON"), through + "0 " + through);
  EXPECT_EQ(said("COOLNT/CRYO"), "1:8: warning: COOLNT: CRYO is not known and was skipped\n");
}

TEST(Reader, TheGaugeLengthOfAToolIsThatOfTheWord) {
  const auto reading = read(
      "UNITS/INCHES\nLOADTL/7,LENGTH,4\nUNITS/MM\nLOADTL/8,LENGTH,200,ADJUST,18\nLOAD/"
      "TOOL,9,OSETNO,19,LENGTH,"
      "120.5\nLOADTL/10\nGOTO/0,0,0\n");
  EXPECT_TRUE(reading.findings.empty()) << joined(reading.findings);
  const auto tools = reading.all<ToolChange>();
  ASSERT_EQ(tools.size(), 4U);
  EXPECT_DOUBLE_EQ(tools[0].gauge_length_mm.value(), 101.6);
  EXPECT_EQ(tools[1].gauge_length_mm, 200.0);
  EXPECT_EQ(tools[1].length_register, 18U);
  EXPECT_EQ(tools[2].gauge_length_mm, 120.5);
  EXPECT_EQ(tools[2].length_register, 19U);
  EXPECT_FALSE(tools[3].gauge_length_mm);
  EXPECT_EQ(joined(read("LOADTL/7,LENGTH,0\nLOADTL/7,LENGTH\nGOTO/0,0,0\n").findings),
            "1:17: error: LOADTL: 0 is not above 0\n2:1: error: LOADTL: value 3 is missing\n");
}

TEST(Reader, ToolsCoolantStopsAndTolerances) {
  const auto reading = read(
      "LOADTL / 2\nLOAD/TOOL,3,ADJUST,13 \nSELECT/TOOL,4\nTLDATA/MILL,32.0000,5.0000,75.0000,0.0000,0.0000\n"
      "COOLNT/FLOOD\nCOOLNT/OFF\nCOOLNT/ON,THRU,70\nDELAY/1.5\nDELAY/3,REV\nOPSTOP\nSTOP\n"
      "LINTOL/0.01\nLINTOL/OFF\nLINTOL/RAPID,0.1\nLINTOL/AXIS,0.0001\nROTABL/SHORT\nGOTO/0,0,0\nFINI\n");
  EXPECT_TRUE(reading.findings.empty()) << joined(reading.findings);
  const auto tools = reading.all<ToolChange>();
  EXPECT_EQ(tools.at(0).number, 2U);
  EXPECT_FALSE(tools.at(0).length_register);
  EXPECT_EQ(tools.at(1).length_register, 13U);
  EXPECT_EQ(reading.all<ToolSelect>().at(0).number, 4U);
  EXPECT_EQ(reading.all<ToolGeometry>().at(0).length_mm, 75.0);
  EXPECT_EQ(reading.all<Coolant>().at(0).kind, Coolant::Kind::flood);
  EXPECT_EQ(reading.all<Coolant>().at(1).kind, Coolant::Kind::off);
  EXPECT_EQ(reading.all<Coolant>().at(2).kind, Coolant::Kind::through);
  EXPECT_EQ(reading.all<Dwell>().at(0).seconds, 1.5);
  EXPECT_EQ(reading.all<Dwell>().at(1).revolutions, 3.0);
  EXPECT_TRUE(reading.all<Stop>().at(0).optional);
  EXPECT_FALSE(reading.all<Stop>().at(1).optional);
  const auto tolerances = reading.all<Tolerance>();
  EXPECT_EQ(tolerances.at(0).value_mm, 0.01);
  EXPECT_FALSE(tolerances.at(1).on);
  EXPECT_EQ(tolerances.at(2).applies, Tolerance::Applies::rapid);
  EXPECT_EQ(tolerances.at(3).axis_angle, 0.0001);
  EXPECT_EQ(reading.all<PostWord>().at(0).fields.at(0), "SHORT");
  EXPECT_EQ(reading.all<End>().size(), 1U);
}

TEST(Reader, DisplayWordsAreSilentAndUnknownOnesAreOneWarningEach) {
  const auto reading =
      read("PAINT/COLOR,211\nFOO/1\nCSI_SET_FLUTE_LENGTH/32.\nFOO/2\nBAR\nMACHIN / UNCX01, 1\nGOTO/0,0,0\n");
  EXPECT_EQ(
      joined(reading.findings),
      "2:1: warning: FOO is not known and was skipped\n5:1: warning: BAR is not known and was skipped\n");
}

TEST(Reader, SynTurnsAWordIntoACommentOrAnother) {
  const auto reading = read("SYN/'TLAXIS','$$*TLAXIS'\nSYN/'ZOOM','RAPID'\nTLAXIS/1,0,0\nZOOM\nGOTO/0,0,0\n");
  EXPECT_TRUE(reading.findings.empty()) << joined(reading.findings);
  EXPECT_EQ(axis(reading, 0), Vec3(0, 0, 1));
  EXPECT_TRUE(reading.motions()[0].rapid);
}

// As it is when it is read while it is copied, or when the disk of the CAM computer was full.
TEST(Reader, FileThatEndsBeforeItsLastWordIsWarnedOf) {
  EXPECT_EQ(joined(read("PARTNO A\nGOTO/0,0,0\n").findings),
            "2: warning: the file ends without FINI: is it whole?\n");
  EXPECT_EQ(joined(read("TOOL PATH/A,TOOL,B\nGOTO/0,0,0\n").findings),
            "2: warning: the file ends without END-OF-PATH: is it whole?\n");
  EXPECT_EQ(joined(read("PARTNO A\nGOTO/0,0,0\nFINI\n").findings), "");
  EXPECT_EQ(joined(read("TOOL PATH/A,TOOL,B\nGOTO/0,0,0\nEND-OF-PATH\n").findings), "");
  EXPECT_EQ(joined(read("GOTO/0,0,0\n").findings), "");
}

// Two files joined: the second would be left out.
TEST(Reader, AMotionBehindFiniIsAnError) {
  const auto reading = read("GOTO/0,0,0\nFINI \n\nPARTNO/B\nGOTO/1,1,1\nGOTO/2,2,2\n");
  EXPECT_EQ(reading.motions().size(), 1U);
  EXPECT_EQ(joined(reading.findings),
            "4:1: warning: PARTNO: what follows FINI is not read\n"
            "5:1: error: GOTO behind FINI: a second program in the file, which would be left out\n");
}

TEST(Reader, CreoDirectivesInComments) {
  const auto reading = read(
      "$$-> FEATNO / 1014\nUNITS / INCHES\n$$-> CUTTER / 6.0\n$$-> CSYS / 1.0, 0.0, 0.0, 0.0,  $\n"
      "            0.0, 1.0, 0.0, 0.0,  $\n            0.0, 0.0, 1.0, 0.0\nGOTO/0,0,0\n$$-> END / \n");
  EXPECT_TRUE(reading.findings.empty()) << joined(reading.findings);
  EXPECT_DOUBLE_EQ(*reading.all<ToolGeometry>().at(0).diameter_mm, 152.4);
  EXPECT_EQ(reading.all<OperationBegin>().at(0).name, "FEATNO 1014");
  EXPECT_EQ(reading.all<Frame>().size(), 1U);
  EXPECT_FALSE(reading.all<Frame>()[0].applied);
}

// A source that hands out the text in pieces of any size.
class Pieces final : public TextSource {
 public:
  Pieces(std::string text, std::size_t piece) : text_(std::move(text)), piece_(piece) {}
  Result<std::size_t> read(char* buffer, std::size_t capacity) override {
    const std::size_t count = std::min({piece_, capacity, text_.size() - offset_});
    text_.copy(buffer, count, offset_);
    offset_ += count;
    return count;
  }

 private:
  std::string text_;
  std::size_t piece_;
  std::size_t offset_ = 0;
};

TEST(Reader, ALongFileReadsTheSameInPiecesOfAnySize) {
  std::string text = "UNITS/MM\n";
  constexpr int kPoints = 20000;  // several times the reader's buffer
  for (int i = 0; i < kPoints; ++i) {
    if (i % 97 == 0) text += "RAPID\n";
    text += "GOTO / " + std::to_string(i) + ".125, 1.0, -2.5,";
    if (i % 3 == 0) text += "  $\n";
    text += "0.6, 0.0, 0.8\n";
  }
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{4096}, text.size()}) {
    Diagnostics diagnostics;
    Reader reader(std::make_unique<Pieces>(text, piece), "f", {}, diagnostics);
    Record record;
    int count = 0;
    while (reader.next(record)) {
      const auto* motion = std::get_if<Motion>(&record.data);
      ASSERT_NE(motion, nullptr);
      ASSERT_EQ(motion->tip_P, Vec3(count + 0.125, 1.0, -2.5));
      ASSERT_EQ(motion->rapid, count % 97 == 0);
      ++count;
    }
    EXPECT_EQ(count, kPoints);
    EXPECT_FALSE(diagnostics.has_errors());
  }
}

}  // namespace
}  // namespace trunnion::cl
