#include <gtest/gtest.h>
#include <string>

#include "cl/support.hpp"

namespace trunnion::cl {
namespace {

using test::joined;
using test::read;

Vec3 nth_tip(const test::Reading& reading, std::size_t i) {
  return reading.motions().at(i).tip_P;
}
Vec3 nth_axis(const test::Reading& reading, std::size_t i) {
  return reading.motions().at(i).axis_P;
}

TEST(Words, FromBehindMotionsMovesNothing) {
  const std::string cl = "FROM/0,0,80\nGOTO/0,0,-20\n";
  EXPECT_EQ(joined(read(cl + "FROM/0,0,-20\nGOTO/0,30,-20\n").findings), "");
  EXPECT_EQ(joined(read(cl + "FROM/0,0,80\nGOTO/0,30,-20\n").findings),
            "3:1: warning: FROM names another place than the tool has come to: it moves nothing, the next "
            "motion begins where the tool is\n");
  // Where it is, and not where FROM says.
  EXPECT_EQ(nth_tip(read(cl + "FROM/0,0,80\nGODLTA/0,30,0\n"), 1), Vec3(0, 30, -20));
  EXPECT_EQ(joined(read("FROM/0,0,80\nFROM/0,0,90\nGOTO/0,0,-20\n").findings), "");
}

TEST(Words, RapidOffMakesNoRapid) {
  const auto rapids = [](const std::string& text) {
    std::string out;
    for (const Motion& motion : read(text).motions()) out += motion.rapid ? 'r' : 'c';
    return out;
  };
  const std::string point = "GOTO/1,0,0\n";
  EXPECT_EQ(rapids("FEDRAT/5\nRAPID/ON\n" + point + "RAPID/OFF\n" + point + "RAPID\n" + point), "rcr");
  EXPECT_EQ(rapids("FEDRAT/5\nRAPID\nRAPID/OFF\n" + point + "RAPID/ON\n" + point + point), "crc");
  EXPECT_EQ(rapids("FEDRAT/5\nRAPID/OFF,\n" + point + "rapid/off\n" + point + "RAPID/ALL,OFF\n" + point),
            "ccc");
}

TEST(Words, TheUnitOfAFileThatSaysNoneIsAskedFor) {
  const auto unsaid = [](const std::string& text) { return joined(read(text, {}).findings); };
  EXPECT_EQ(unsaid("GOTO/1,0,0\n"),
            " note: nothing in the file says its unit of length: taken as mm (--cl-units mm or inch)\n");
  EXPECT_EQ(unsaid("FEDRAT/MMPM,40\nGOTO/1,0,0\n"), "");
  EXPECT_EQ(unsaid("UNITS/INCHES\nFEDRAT/IPM,40\nGOTO/1,0,0\n"), "");
  const std::string message =
      ": error: a feed in inches, and no UNITS before the points: are they in inches or mm? (--cl-units inch "
      "or "
      "mm)\n";
  EXPECT_EQ(unsaid("GOTO/1,0,0\nFEDRAT/IPM,40\nGOTO/2,0,0\n"), "2:8" + message);
  EXPECT_EQ(unsaid("GOTO/1,0,0\nCYCLE/DRILL,DEPTH,1,IPR,0.01,CLEAR,1\nGOTO/2,0,0\n"), "2:21" + message);
  EXPECT_EQ(
      unsaid("GOTO/1,0,0\nUNITS/INCHES\nGOTO/2,0,0\n"),
      "2:1: error: UNITS/INCHES behind lengths (line 1) whose unit nothing says: move it before them\n");
  ReaderOptions inch;
  inch.units = ReaderOptions::Units::inch;
  const auto given = read("GOTO/1,0,0\nFEDRAT/IPM,60\nGOTO/2,0,0\n", inch);
  EXPECT_EQ(joined(given.findings), "");
  EXPECT_EQ(nth_tip(given, 1), Vec3(50.8, 0, 0));
  EXPECT_DOUBLE_EQ(given.motions()[1].feed.value, 25.4);
}

TEST(Words, GohomeIsARapidToItsPointOrToThatOfFrom) {
  const auto reading =
      read("FROM/50,-20,200,0,0,1\nFEDRAT/60\nGOTO/1,2,3\nGOHOME/5,6,7\nGOTO/1,2,3,0.6,0,0.8\nGOHOME\n");
  EXPECT_EQ(joined(reading.findings), "");
  EXPECT_EQ(nth_tip(reading, 1), Vec3(5, 6, 7));
  EXPECT_TRUE(reading.motions()[1].rapid);
  EXPECT_FALSE(reading.motions()[2].rapid);
  EXPECT_EQ(nth_tip(reading, 3), Vec3(50, -20, 200));
  EXPECT_EQ(nth_axis(reading, 3), Vec3(0, 0, 1));
  EXPECT_TRUE(reading.motions()[3].rapid);
  EXPECT_EQ(joined(read("GOTO/0,0,0\nGOHOME\n").findings),
            "2:1: error: GOHOME without values, and no FROM before it says where that is\n");
}

TEST(Words, SetOfsetlIsTheWorkOffset) {
  const auto index_of = [](const std::string& text) {
    const auto reading = read(text);
    for (const Record& record : reading.records) {
      if (const auto* offset = std::get_if<WorkOffset>(&record.data)) return std::to_string(offset->index);
    }
    return joined(reading.findings);
  };
  EXPECT_EQ(index_of("SET/OFSETL,3\nGOTO/1,2,3\n"), "3");
  // Or the register of a length? It would move the part by a work offset.
  EXPECT_EQ(index_of("SET/ADJUST,2\nGOTO/1,2,3\n").substr(0, 38), "1:1: error: SET/ADJUST: a work offset,");
  EXPECT_EQ(index_of("SET/OFSETL,0\nGOTO/1,2,3\n"),
            "1:12: error: SET: work offsets are numbered from 1 (G54) on\n");
  EXPECT_EQ(index_of("SET/HEAD,1\nGOTO/1,2,3\n"), "1:1: warning: SET/HEAD is not acted on\n");
}

TEST(Words, AFileOfALatheIsRefusedAsSuch) {
  const std::string behind = ": this is the file of a lathe; turning has no tool axis and is not posted\n";
  const auto verdict = [](const std::string& text) { return joined(read(text).findings); };
  EXPECT_EQ(verdict("MODE/TURN\nGOTO/1\nGOTO/1,2,3\n"), "1:1: error: MODE/TURN" + behind);
  EXPECT_EQ(verdict("TURRET/1,OSETNO,1\nGOTO/1,2,3\n"), "1:1: error: TURRET" + behind);
  EXPECT_EQ(verdict("TLDATA/TURN,1,2\nGOTO/1,2,3\n"), "1:1: error: TLDATA/TURN" + behind);
  EXPECT_EQ(verdict("TOOLNO/1,TURN\nGOTO/1,2,3\n"), "1:1: error: TOOLNO/TURN" + behind);
  EXPECT_EQ(
      verdict("CUTTER/0.8\nSPINDL/500,SFM,CLW\nGOTO/13,0,2\n"),
      "2:1: error: SPINDL with a surface speed, where no tool axis, MULTAX, MODE/MILL or milling cutter "
      "shows a mill" +
          behind);
  EXPECT_EQ(verdict("CUTTER/10,1\nSPINDL/500,SFM,CLW\nGOTO/13,0,2\n"), "");
  EXPECT_EQ(verdict("MODE/MILL\nGOTO/13,0,2\n"), "");
  EXPECT_EQ(
      verdict("MODE/EDM\nGOTO/13,0,2\n"),
      "1:1: error: MODE/EDM changes the geometry and is not understood by this program; MODE/MILL is\n");
}

TEST(Words, WordsThatSayNothingForAMillAreSilent) {
  const auto reading = read("SPINDL/MAIN\nGOTO/0,0,0\nEND\nFINI\n");
  EXPECT_EQ(joined(reading.findings), "");
  EXPECT_TRUE(reading.all<Spindle>().empty());
}

TEST(Words, ASubprogramIsSkippedByName) {
  EXPECT_EQ(joined(read("CALSUB/START_PROG\nCALSUB/START_PROG\nCALSUB/END_PROG\nGOTO/0,0,0\n").findings),
            "1:1: warning: CALSUB/START_PROG: the subprogram is not called\n"
            "3:1: warning: CALSUB/END_PROG: the subprogram is not called\n");
}

// x' = y, y' = -x, z' = z: a quarter turn about z, and an origin.
TEST(Words, PointsAndAxesBehindMcsAreGivenInIt) {
  const auto reading = read(
      "GOTO/1,0,0,0,0,1\nMCS/0,1,0, -1,0,0, 0,0,1, 10,20,30\nGOTO/1,2,3\nGOTO/1,2,3,0.6,0,0.8\n"
      "MCS/0,0.6,0.8, -1,0,0, 0,-0.8,0.6, 0,0,0\nGOTO/0,0,5\nMCS/1,0,0, 0,1,0, 0,0,1, 0,0,0\nGOTO/1,2,3\n");
  EXPECT_EQ(reading.findings.size(), 2U) << joined(reading.findings);
  EXPECT_NEAR((nth_tip(reading, 1) - Vec3(8, 21, 33)).norm(), 0.0, 1e-12);
  EXPECT_EQ(nth_axis(reading, 1), Vec3(0, 0, 1));
  EXPECT_NEAR((nth_axis(reading, 2) - Vec3(0, 0.6, 0.8)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((nth_tip(reading, 3) - Vec3(0, -4, 3)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((nth_axis(reading, 3) - Vec3(0, -0.8, 0.6)).norm(), 0.0, 1e-12);
  EXPECT_EQ(nth_tip(reading, 4), Vec3(1, 2, 3));
  EXPECT_EQ(nth_axis(reading, 4), Vec3(0, 0, 1));
  EXPECT_EQ(joined(read("MCS/1,0,0, 0,1,0, 0,0,-1, 0,0,0\nGOTO/1,2,3\n").findings),
            "1:1: error: MCS: its axes are not three unit vectors at right angles, right-handed\n");
}

// RAPID before a RETRCT that has nothing to do would make a rapid of the cut behind it.
TEST(Words, RetrctTakesRapidWhereverTheToolStands) {
  for (const std::string z : {"60", "40"}) {
    const auto motions =
        read("GOTO/0,0," + z + ",0,0,1\nCLEARP/XYPLAN,50\nRAPID\nRETRCT\nGOTO/0,0,5\n").motions();
    EXPECT_FALSE(motions.back().rapid) << z;
    EXPECT_EQ(motions.size(), z == "60" ? 2U : 3U);
  }
}

TEST(Words, ASpeedOfNoneStopsTheSpindle) {
  for (const std::string none : {"SPINDL/0", "SPINDL/RPM,0,CLW", "SPINDL/0,SMM"}) {
    const auto spindles =
        read("MODE/MILL\nMULTAX\nSPINDL/2000,RPM,CLW\nGOTO/0,0,1\n" + none + "\nGOTO/0,0,2\n").all<Spindle>();
    ASSERT_EQ(spindles.size(), 2U) << none;
    EXPECT_EQ(spindles[1].state, Spindle::State::off) << none;
    EXPECT_FALSE(spindles[1].speed_rpm) << none;
  }
}

TEST(Words, ASecondValueOfASpeedIsNoneOfIt) {
  EXPECT_EQ(joined(read("SPINDL/3,000,CLW\nGOTO/0,0,1\n").findings), "1:10: error: SPINDL: a second value\n");
  EXPECT_EQ(joined(read("SPINDL/RPM,3000,CLW,RANGE,2\nGOTO/0,0,1\n").findings).find("error"),
            std::string::npos);
}

TEST(Words, EveryKindOfCoolantThatIsSaidFlows) {
  using Kinds = std::vector<Coolant::Kind>;
  const auto kinds = [](const std::string& fields) {
    Kinds out;
    for (const Coolant& c : read("COOLNT/" + fields + "\nGOTO/0,0,1\n").all<Coolant>()) out.push_back(c.kind);
    return out;
  };
  EXPECT_EQ(kinds("FLOOD,2,MIST"), (Kinds{Coolant::Kind::flood, Coolant::Kind::mist}));
  EXPECT_EQ(kinds("FLOOD,ON"), (Kinds{Coolant::Kind::flood}));
  EXPECT_EQ(kinds("OFF,FLOOD"), (Kinds{Coolant::Kind::off}));
  EXPECT_EQ(kinds("ON"), (Kinds{Coolant::Kind::on}));
}

// 500 ms are no 500 s.
TEST(Words, TheUnitOfADelayIsKnown) {
  EXPECT_EQ(joined(read("DELAY/2\nDELAY/2,SEC\nDELAY/2,REV\nGOTO/0,0,1\n").findings), "");
  EXPECT_EQ(joined(read("DELAY/500,MSEC\nGOTO/0,0,1\n").findings),
            "1:11: error: DELAY: 'MSEC' is not understood; DELAY/s, in seconds, and DELAY/n,REV are\n");
}

TEST(Words, AToolThatOnlyItsNameChangesIsNotLoaded) {
  const auto operation = [](const std::string& name, const std::string& tool, const std::string& load) {
    return "TOOL PATH/" + name + ",TOOL," + tool + "\n" + load + "GOTO/0,0,1\nEND-OF-PATH\n";
  };
  const std::string first = operation("ROUGH", "MILL_D20", "LOAD/TOOL,1\n");
  EXPECT_EQ(joined(read(first + operation("FINISH", "BALL_D6", "LOAD/TOOL,2\n")).findings), "");
  EXPECT_EQ(joined(read(first + operation("FINISH", "MILL_D20", "")).findings), "");
  EXPECT_EQ(joined(read(first + "LOAD/TOOL,2\n" + operation("FINISH", "BALL_D6", "")).findings), "");
  for (const std::string& end : {std::string("END-OF-PATH\n"), std::string()}) {
    std::string second = operation("FINISH", "BALL_D6", "");
    second.resize(second.size() - std::string("END-OF-PATH\n").size());
    EXPECT_NE(joined(read(first + second + end).findings)
                  .find("5:1: error: the operation is made with tool BALL_D6, the one before with MILL_D20"),
              std::string::npos);
  }
}

TEST(Words, AFileThatEndsInANumberMayBeCut) {
  const std::string head = "GOTO/1.500,2.500,25.000\n";
  EXPECT_EQ(joined(read(head + "GOTO/1.500,2.500,3").findings),
            "2: error: the file ends in a line without an end, and its last number, 3, has fewer decimals "
            "than others: it is cut off, or end the line\n");
  EXPECT_EQ(joined(read(head + "GOTO/1.500,2.500,30.000").findings), "");
  EXPECT_EQ(joined(read(head + "GOTO/1.500,2.500,3\n").findings), "");
}

// The post is told of it in P.
TEST(Words, AClearancePlaneGoesToThePostInTheFrameOfThePart) {
  const auto words =
      read("MCS/1,0,0,0,1,0,0,0,1,0,0,30\nGOTO/0,0,50\nCLEARP/XYPLAN,60\nGOTO/0,0,20\n").all<PostWord>();
  ASSERT_EQ(words.size(), 1U);
  EXPECT_EQ(words[0].fields, (std::vector<std::string>{"0", "0", "1", "90"}));
}

// The plane of CLEARP was given in the frame before: at its number the tool would stay 30 mm too low.
TEST(Words, AClearancePlaneIsThatOfItsFrame) {
  const std::string head = "GOTO/0,0,50,0,0,1\nCLEARP/XYPLAN,60\n";
  EXPECT_EQ(read(head + "RETRCT\n").motions().back().tip_P, Vec3(0, 0, 60));
  const std::string mcs = "MCS/1,0,0,0,1,0,0,0,1,0,0,-30\nGOTO/0,0,80\n";
  EXPECT_NE(joined(read(head + mcs + "RETRCT\n").findings)
                .find("no clearance plane (CLEARP) before it, in this frame"),
            std::string::npos);
  EXPECT_EQ(read(head + mcs + "CLEARP/XYPLAN,90\nRETRCT\n").motions().back().tip_P, Vec3(0, 0, 60));
  EXPECT_EQ(read(head + "MCS/1,0,0,0,1,0,0,0,1,0,0,0\nGOTO/0,0,20\nRETRCT\n").motions().back().tip_P,
            Vec3(0, 0, 60));
  const std::string msys = "MSYS/0,0,0,1,0,0,0,1,0\n";
  EXPECT_NE(joined(read(msys + head + "MSYS/0,0,-30,1,0,0,0,1,0\nGOTO/0,0,80\nRETRCT\n").findings)
                .find("in this frame"),
            std::string::npos);
}

// A word that might move the tool's point does not get lost without a word.
TEST(Words, WhatStandsBehindAToolIsNotSkippedInSilence) {
  EXPECT_NE(joined(read("LOADTL/2,SETOOL,0,0,30\nGOTO/0,0,5\n").findings).find("LOADTL: SETOOL is not known"),
            std::string::npos);
  EXPECT_EQ(joined(read("LOADTL/2,ADJUST,2,LENGTH,80\nGOTO/0,0,5\n").findings), "");
}

TEST(Words, TheAxisBehindMultaxOffDependsOnTheSystem) {
  const std::string path = "GOTO/0,0,0,0.6,0,0.8\nMULTAX/OFF\nGOTO/1,2,3\n";
  EXPECT_EQ(
      joined(read(path).findings),
      "3:1: error: GOTO without a tool axis behind MULTAX/OFF: that before it (CATIA), or +Z (Fusion)?\n");
  EXPECT_EQ(nth_axis(read("MODE/MILL\n" + path), 1), Vec3(0, 0, 1));
  EXPECT_EQ(nth_axis(read("$$ CATIA APT VERSION 1.0\n" + path), 1), Vec3(0.6, 0, 0.8));
  EXPECT_EQ(joined(read("GOTO/0,0,0,0.6,0,0.8\nMULTAX/OFF\nGOTO/1,2,3,0,0,1\nGOTO/2,2,3\n").findings), "");
}

TEST(Words, ToolsOfFusionAndDrillsOfNx) {
  const auto reading =
      read("LOADTL/3, 0, 40.000000, 13\nTLDATA/DRILL,MILL,63.0,0.0,239.0,178.0,35.0\nGOTO/0,0,0\n");
  const ToolChange tool = reading.all<ToolChange>().at(0);
  EXPECT_EQ(tool.number, 3U);
  EXPECT_EQ(tool.length_register, 13U);
  EXPECT_FALSE(tool.gauge_length_mm);
  EXPECT_EQ(reading.findings.size(), 1U) << joined(reading.findings);
  EXPECT_EQ(reading.all<ToolGeometry>().at(0).diameter_mm, 63.0);
}

TEST(Words, NoCharacterOfATextActsOnATerminalOrAPage) {
  const auto shown = [](const std::string& text) {
    return read("PPRINT " + text + "\nGOTO/0,0,0\n").all<Text>().at(0).text;
  };
  EXPECT_EQ(shown("Fr\xC3\xA4ser \xE2\x8C\x80"
                  "12"),
            "Fr\xC3\xA4ser \xE2\x8C\x80"
            "12");
  EXPECT_EQ(shown("Fr\xE4ser"), "Fr?ser");  // Latin-1
  EXPECT_EQ(shown("a\x9B"
                  "2Jb\xC2\x9B"
                  "2J"),
            "a?2Jb?2J");  // CSI in one byte, and as UTF-8
  EXPECT_EQ(shown("a\xE2\x80\xA8"
                  "b\xE2\x80\xAE"
                  "c"),
            "a?b?c");  // line separator, right to left
  EXPECT_EQ(shown("a\xC0\xAF"
                  "b\xED\xA0\x80"
                  "c\xF5\x80\x80\x80"),
            "a??b???c????");
  EXPECT_EQ(shown("a\xE2\x80"), "a??");
  EXPECT_EQ(read("CSI_TOOL_PATH/Swarf, 1\nGOTO/0,0,0\n").all<OperationBegin>().at(0).name, "Swarf, 1");
}

TEST(Words, WhatContradictsWithinAStatementIsRefused) {
  const auto said = [](const std::string& words) { return joined(read(words + "\nGOTO/0,0,1\n").findings); };
  for (const char* wrong :
       {"LOADTL/4,LENGTH,90,LENGTH,130", "LOADTL/5,OSETNO,7,ADJUST,8", "LOADTL/5,LENGTH,1e300",
        "SPINDL/CLW,CCLW,3000", "SPINDL/OFF,CLW", "SPINDL/3000,CLW,OFF", "SPINDL/3000,RPM,SFM", "CUTTER/-5",
        "CUTTER/10,-3", "CUTTER/1e300", "TLDATA/MILL,-10,0,75,0,0", "LOOP/3", "REPEAT/2", "IF(A) 1,2,3",
        "INCR", "LOCAL/MATRIX,1,0,0,10,0,1,0,0,0,0,1,0", "G0 X5 Y5", "X5 Y5", "G92 X0"})
    EXPECT_NE(said(wrong).find(": error: "), std::string::npos) << wrong << "\n" << said(wrong);
  for (const char* right : {"LOADTL/4,LENGTH,90,ADJUST,8", "SPINDL/RPM,3000,CLW", "SPINDL/ON,3000,CLW",
                            "SPINDL/OFF", "CUTTER/0", "CUTTER/10,2", "SPINDL/STOP", "CUTTER/0.001,0"})
    EXPECT_EQ(said(right).find(": error: "), std::string::npos) << right << "\n" << said(right);
}

}  // namespace
}  // namespace trunnion::cl
