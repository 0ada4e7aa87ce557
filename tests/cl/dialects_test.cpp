#include <gtest/gtest.h>
#include <string>

#include "cl/support.hpp"

namespace trunnion::cl {
namespace {

using test::joined;
using test::read;

ReaderOptions nci(bool mark_shapes = false) {
  ReaderOptions options = test::in_mm();
  options.dialect = ReaderOptions::Dialect::nci;
  options.mark_shapes = mark_shapes;
  return options;
}

TEST(Nci, FiveAxisMotionsAreTipAndSecondPoint) {
  const auto reading = read(
      "1050\n9 1 1 1 2020 1 1 1 PART.NCI\n1013\n0 10. 5.\n1002\n1 2 0 7 17 27 0 3000. 100. 1\n1008\nFINISH "
      "BLADE\n"
      "11\n1. 2. 3. 1. 2. 103. -2. 0 0\n11\n1. 2. 0. 61. 2. 80. 600. 0 0\n11\n2. 2. 0. 62. 2. 80. -1. 0 "
      "0\n1003\n0\n",
      nci());
  ASSERT_EQ(joined(reading.findings),
            "6:28: warning: the coolant 1 of this tool is not acted on: the program switches none on\n");
  const auto motions = reading.motions();
  ASSERT_EQ(motions.size(), 3U);
  EXPECT_TRUE(motions[0].rapid);
  EXPECT_EQ(motions[0].axis_P, Vec3(0, 0, 1));
  EXPECT_NEAR((motions[1].axis_P - Vec3(0.6, 0, 0.8)).norm(), 0.0, 1e-15);
  EXPECT_FALSE(motions[1].rapid);
  EXPECT_EQ(motions[2].feed, (Feed{FeedMode::per_minute, 10.0}));
  EXPECT_EQ(reading.all<ToolChange>().at(0).number, 7U);
  EXPECT_EQ(reading.all<ToolChange>().at(0).length_register, 27U);
  EXPECT_EQ(reading.all<Spindle>().at(0).speed_rpm, 3000.0);
  EXPECT_EQ(reading.all<ToolGeometry>().at(0).diameter_mm, 10.0);
  EXPECT_EQ(reading.all<Text>().at(0).text, "FINISH BLADE");
  EXPECT_EQ(reading.all<End>().size(), 1U);
}

TEST(Nci, LinesAndArcsInTheTopPlane) {
  const auto reading = read(
      "0\n0 10. 0. 5. -2. 0\n1\n0 10. 0. 0. 60. 0\n3\n0 0 0. 10. 0. 0. 0. -1. 0\n2\n0 0 10. 0. 0. 0. 0. -1. "
      "0\n1003\n0\n",
      nci(true));
  ASSERT_EQ(joined(reading.findings), "");
  EXPECT_TRUE(reading.motions().at(0).rapid);
  const auto arcs = reading.arcs();
  EXPECT_EQ(arcs.at(0).sweep.deg(), 90.0);
  EXPECT_EQ(arcs.at(0).normal_P, Vec3(0, 0, 1));
  EXPECT_EQ(arcs.at(1).sweep.deg(), 90.0);
  EXPECT_EQ(arcs.at(1).normal_P, Vec3(0, 0, -1));
}

TEST(Nci, WithoutAToolChangeTheToolStays) {
  const std::string head = "1001\n0 0 0 7 7 7 0 3000\n0\n0 0. 0. 5. -2. 0\n1000\n0 0 0 ";
  EXPECT_EQ(joined(read(head + "7 7 7 0 2000\n1003\n0\n", nci()).findings), "");
  for (const std::string tool : {"8 7 7", "7 7 8"}) {
    EXPECT_NE(joined(read(head + tool + " 0 2000\n1003\n0\n", nci()).findings)
                  .find("5:1: error: 1000 keeps the tool, which is 7 with length register 7"),
              std::string::npos);
  }
}

TEST(Nci, AFileWithoutItsEndMayBeCut) {
  EXPECT_EQ(joined(read("0\n0 10. 0. 5.25 -2. 0\n", nci()).findings),
            "2: warning: the file ends without 1003: is it whole?\n");
}

TEST(Nci, WhatIsNotUnderstoodIsAnErrorByCode) {
  EXPECT_EQ(
      joined(read("1\n41 1 2 3 60 0\n", nci()).findings),
      "1:1: error: NCI 1: cutter compensation changes the geometry and is not understood by this program\n");
  EXPECT_EQ(joined(read("81\n0 0 0 0\n", nci()).findings),
            "1:1: error: NCI 81 changes the geometry and is not understood by this program\n");
  for (const char* code : {"1018", "1019"})  // a subprogram
    EXPECT_EQ(joined(read(std::string(code) + "\n1 0\n1\n0 1 2 3 60 0\n", nci()).findings),
              std::string("1:1: error: NCI ") + code +
                  " changes the geometry and is not understood by this program\n");
  EXPECT_EQ(joined(read("1014\n1 0 0 0 0 1 0 -1 0\n1\n0 1 2 3 60 0\n", nci()).findings),
            "3:1: error: NCI 1 in a turned plane (1014, 1027) is not understood by this program\n");
  EXPECT_EQ(
      joined(read("11\n1 2 3 1 2 3 60 0 0\n", nci()).findings),
      "1:1: error: NCI 11: the tip and the second point are 0 mm apart: the tool axis has no direction\n");
  EXPECT_EQ(joined(read("11\n1 2 3 1 2\n", nci()).findings), "1:1: error: NCI 11: value 6 is missing\n");
  EXPECT_EQ(joined(read("1 2\n", nci()).findings), "1:1: error: NCI: a line with one code is needed\n");
  EXPECT_EQ(joined(read("1\n0 1 2 3 0 0\n", nci()).findings),
            "2:9: error: NCI 1: feed 0; above 0, -1 (unchanged) or -2 (rapid) is needed\n");
}

// One byte, and others that leave nothing of a line.
TEST(Nci, LinesWithoutACodeAreErrors) {
  for (const std::string text : {",", " ,", ",\n", ",,,\n0\n", "\t,\t", "0\n,\n", ",0\n"}) {
    const auto reading = read(text, nci());
    EXPECT_FALSE(reading.findings.empty()) << text;
    EXPECT_TRUE(reading.motions().empty()) << text;
  }
  EXPECT_EQ(joined(read(",", nci()).findings), "1:1: error: NCI: a line with one code is needed\n");
}

TEST(Nci, ASecondFileBehindTheEndIsAnError) {
  const std::string one = "1\n0 1 2 3 60 0\n1003\n0\n";
  EXPECT_EQ(joined(read(one + "\n \n", nci()).findings), "");
  EXPECT_EQ(joined(read(one + one, nci()).findings),
            "5:1: error: NCI: what stands behind the end (1003) would be left out: a second file?\n");
}

TEST(Nci, TheEndingOfTheNameTellsTheDialect) {
  Diagnostics diagnostics;
  EXPECT_TRUE(read_program("0\n0 1 2 3 -2 0\n", "PART.NCI", {}, diagnostics));
  EXPECT_FALSE(read_program("0\n0 1 2 3 -2 0\n", "part.cls", {}, diagnostics));
}

constexpr char kSystem[] =
    "$$*CATIA0\n$$ Axis.1\n$$     1.00000     0.00000     0.00000     5.00000\n"
    "$$     0.00000    -1.00000     0.00000     0.00000\n$$     0.00000     0.00000    -1.00000     "
    "0.00000\n";

TEST(Catia, PointsStandInTheFilesAxisSystem) {
  const auto reading = read(std::string(kSystem) + "GOTO/1,2,3\n" + kSystem + "GOTO/2,3,4\n");
  EXPECT_EQ(joined(reading.findings), "");
  EXPECT_EQ(reading.motions().at(0).tip_P, Vec3(1, 2, 3));
  std::string other = kSystem;
  other.replace(other.find("5.00000"), 1, "6");
  EXPECT_EQ(joined(read(std::string(kSystem) + "GOTO/1,2,3\n" + other + "GOTO/2,3,4\n").findings),
            "7:1: error: $$*CATIA0: a second machining axis system changes the geometry and is not "
            "understood by this program\n");
  EXPECT_EQ(joined(read("$$*CATIA0\n$$ name\n$$ 1 2 3\nGOTO/1,2,3\n").findings),
            "3:1: error: $$*CATIA0: three lines of four numbers are needed\n");
}

TEST(Catia, TheAxisStaysBehindMultaxOff) {
  const auto reading = read(
      "$$ CATIA APT VERSION "
      "1.0\nMULTAX\nGOTO/1,2,3,0.6,0.0,0.8\nMULTAX/OFF\nGOTO/4,5,6\nMULTAX/ON\nGOTO/4,5,6,0,0,1\n");
  EXPECT_EQ(joined(reading.findings), "");
  EXPECT_EQ(reading.motions().at(1).axis_P, reading.motions().at(0).axis_P);
  EXPECT_EQ(reading.motions().at(2).axis_P, Vec3(0, 0, 1));
}

TEST(Catia, AnArcStartsInTheDirectionOfIndirv) {
  ReaderOptions options = test::in_mm();
  options.mark_shapes = true;
  const std::string arc =
      "TLON,GOFWD/ (CIRCLE/  0.00000,  0.00000,  5.00000,$\n 10.00000),ON,(LINE/  0.00000, 0.00000, "
      "5.00000,$\n 0.00000, 10.00000, 5.00000)\n";
  const auto counter = read("GOTO/10,0,5\nAUTOPS\nINDIRV/0,1,0\n" + arc, options);
  ASSERT_EQ(joined(counter.findings), "");
  EXPECT_EQ(counter.arcs().at(0).sweep.deg(), 90.0);
  const auto clockwise = read("GOTO/10,0,5\nAUTOPS\nINDIRV/0,-1,0\n" + arc + "GOTO/0,20,5\n", options);
  EXPECT_EQ(clockwise.arcs().at(0).sweep.deg(), 270.0);
  EXPECT_EQ(clockwise.arcs().at(0).normal_P, Vec3(0, 0, -1));
  EXPECT_EQ(clockwise.motions().back().tip_P, Vec3(0, 20, 5));
  const std::string second =
      "TLON,GOFWD/ (CIRCLE/ 0., 0., 5., 10.),ON,2,INTOF,$\n (LINE/ 0., 0., 5., 0., 10., 5.)\n";
  EXPECT_EQ(read("GOTO/10,0,5\nINDIRV/0,-1,0\n" + second, options).arcs().at(0).sweep.deg(), 270.0);
  EXPECT_EQ(joined(read("GOTO/10,0,5\nINDIRV/1,0,0\n" + arc).findings),
            "3:1: error: TLON: INDIRV points along the radius: the sense is not known\n");
  EXPECT_EQ(joined(read("GOTO/10,0,5\n" + arc).findings),
            "2:1: error: TLON: the start or its direction (INDIRV) is missing\n");
}

// NCL's .as text: unit-less feeds, numbers in wide columns, PPRINT without a separator.
TEST(Ncl, ColumnsOfTheApTextFile) {
  const auto reading = read(
      "REMARK x.as 27-APR-2021 10:11:12  NCLCAM\nPARTNODOOR_1\nUNITS/INCHES\nCUTTER/   0.750,   0.125,   "
      "0.250,   0.125,   0.000,   0.000,   2.250\n"
      "MULTAX/ON\nFEDRAT/       100\nGOTO  /   59.5108,    1.7270,    2.3023, 0.0091316,-0.0049284, "
      "0.9999462\nFINI\n");
  EXPECT_EQ(joined(reading.findings), "");
  EXPECT_DOUBLE_EQ(reading.motions().at(0).tip_P.x(), 59.5108 * 25.4);
  EXPECT_DOUBLE_EQ(reading.motions().at(0).feed.value, 100.0 * 25.4 / 60.0);
  EXPECT_DOUBLE_EQ(*reading.all<ToolGeometry>().at(0).length_mm, 2.25 * 25.4);
}

}  // namespace
}  // namespace trunnion::cl
