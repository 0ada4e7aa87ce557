#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <string>

#include "trunnion/cl/arc.hpp"

#include "cl/support.hpp"

namespace trunnion::cl {
namespace {

using test::joined;
using test::read;

ReaderOptions with_shapes() {
  ReaderOptions options = test::in_mm();
  options.mark_shapes = true;
  return options;
}

TEST(Circle, NxTurnsClockwiseAboutItsAxis) {
  // From a real file: a quarter turn that goes on tangentially from the line before it.
  const auto reading = read(
      "GOTO/-7.1838,23.0,70.0\nCIRCLE/5.3162,23.0,70.0,0.0,0.0,-1.0,12.5,0.06,0.5,25.0,0.0\nGOTO/"
      "5.3162,10.5,70.0\n",
      with_shapes());
  ASSERT_EQ(joined(reading.findings), "");
  const Arc arc = reading.arcs().at(0);
  EXPECT_EQ(arc.normal_P, Vec3(0, 0, 1));
  EXPECT_NEAR(arc.sweep.deg(), 90.0, 1e-9);
  EXPECT_NEAR(
      (point_on(arc, 0.5) - Vec3(5.3162 - 12.5 * std::sqrt(0.5), 23.0 - 12.5 * std::sqrt(0.5), 70.0)).norm(),
      0.0, 1e-12);
  const auto long_way = read(
      "GOTO/-7.1838,23.0,70.0\nCIRCLE/5.3162,23.0,70.0,0.0,0.0,1.0,12.5,0.06,0.5,25.0,0.0\nGOTO/"
      "5.3162,10.5,70.0\n",
      with_shapes());
  EXPECT_NEAR(long_way.arcs().at(0).sweep.deg(), 270.0, 1e-9);
}

TEST(Circle, SolidWorksTurnsByTheRightHandAndClosesFullCircles) {
  const auto reading = read(
      "GOTO/96.4375,41.334899,-3.\nCIRCLE/95.,44.249705,-3.,0,0,-1.\nGOTO/95.,40.999705,-3.\n"
      "GOTO/126.3,0,-4.\nCIRCLE/125.,0,-4.,0,0,1.\nGOTO/126.3,0,-4.\n",
      with_shapes());
  ASSERT_EQ(joined(reading.findings), "");
  const auto arcs = reading.arcs();
  EXPECT_NEAR(arcs.at(0).sweep.deg(), 26.25, 0.01);  // asin(1.4375 / 3.25)
  EXPECT_EQ(arcs.at(1).sweep.deg(), 360.0);
  EXPECT_NEAR((point_on(arcs[1], 0.25) - Vec3(125.0, 1.3, -4.0)).norm(), 0.0, 1e-12);
}

TEST(Circle, AHelixOfSeveralTurns) {
  const auto reading = read(
      "GOTO/-1.0,0.0,0.0\nCIRCLE/0.0,0.0,-2.475,0.0,0.0,-1.0,1.0,0.002,0.5,1.0,0.0,TIMES,2\nGOTO/"
      "-1.0,0.0,-2.475\n",
      with_shapes());
  ASSERT_EQ(joined(reading.findings), "");
  const Arc arc = reading.arcs().at(0);
  EXPECT_EQ(arc.sweep.deg(), 720.0);
  EXPECT_NEAR((point_on(arc, 0.25) - Vec3(1.0, 0.0, -2.475 / 4)).norm(), 0.0, 1e-12);
}

TEST(Circle, FaultsAreNamedWithTheirNumbers) {
  const std::string start = "GOTO/10,0,0\n";
  const auto error_of = [&](const std::string& text) { return joined(read(start + text).findings); };
  EXPECT_EQ(error_of("CIRCLE/0,0,0,0,0,1\nGOTO/0,10.1,0\n"),
            "2:1: error: CIRCLE: radius to its start 10 mm, to its end 10.1 mm\n");
  EXPECT_EQ(error_of("CIRCLE/0,0,0,0,0,1,9,.1,.5,5,0\nGOTO/0,10,0\n"),
            "2:1: error: CIRCLE: radius to its start 10 mm, to its end 10 mm, as given 9 mm\n");
  EXPECT_EQ(error_of("CIRCLE/0,0,0,0,0,1,10,.1,.5,5,0\nGOTO/10,0,0\n"),
            "2:1: error: CIRCLE: it ends where it starts: a full circle or none?\n");
  EXPECT_EQ(error_of("CIRCLE/0,0,0,0,0,1\n"), "2:1: error: CIRCLE: the end (GOTO) of the arc is missing\n");
  EXPECT_EQ(error_of("CIRCLE/0,0,0,0,0,2\nGOTO/0,10,0\n"),
            "2:14: error: CIRCLE: its axis is no unit vector\n");
  EXPECT_EQ(error_of("CIRCLE/0,0,0,0,0,1\nGODLTA/0,10,0\n").substr(0, 64),
            "3:1: error: GODLTA behind CIRCLE or under CYCLE: a GOTO is neede");
  EXPECT_EQ(error_of("CIRCLE/0,0,0,0,0,1\nGOTO/0,10,0,1,0,0\n"),
            "3:1: error: the tool axis turns along a CIRCLE: only the tip's way is known\n");
  EXPECT_EQ(error_of("CIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\n"),
            "2:1: error: CIRCLE with 7 values changes the geometry and is not understood by this program: "
            "where it ends is not known (Creo: CIRC_INTERPOLATION POINTS_ONLY or APT_FORMAT)\n");
}

// They would change what the center or the end means.
// Within rounding of a full circle: to take it for none leaves a boss uncut, to take it for a full one cuts
// what was not asked for.
TEST(Circle, NearlyClosedIsNeitherFullNorNone) {
  for (const std::string end : {"10.0,0.001", "10.0,-0.001"}) {
    EXPECT_NE(
        joined(read("GOTO/10.000,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1,10,0.06,0.5,25.0,0.0\nGOTO/" + end + ",0\n")
                   .findings)
            .find("it ends 0.001 mm from where it starts"),
        std::string::npos)
        << end;
  }
}

TEST(Circle, NothingStandsBetweenItsCenterAndItsEnd) {
  for (const char* between :
       {"MCS/1,0,0,0,1,0,0,0,1,0,0,5", "MSYS/0,0,5,1,0,0,0,1,0", "TLAXIS/0,0.6,0.8", "MULTAX/OFF",
        "UNITS/INCHES", "FROM/7,0,50", "LOADTL/2", "CYCLE/DRILL,DEPTH,5,CLEAR,3", "RAPID/ON"}) {
    const std::string text =
        std::string("GOTO/10,0,50,0,0,1\nCIRCLE/0,0,50,0,0,1\n") + between + "\nGOTO/0,10,50\n";
    const std::string word(between, std::string(between).find('/'));
    EXPECT_NE(joined(read(text).findings)
                  .find("3:1: error: " + word + " between CIRCLE and the end (GOTO) of its arc\n"),
              std::string::npos)
        << joined(read(text).findings);
  }
  EXPECT_EQ(joined(read("GOTO/10,0,50,0,0,1\nCIRCLE/0,0,50,0,0,1\nFEDRAT/9,MMPM\nGOTO/0,10,50\n").findings),
            "");
}

TEST(Circle, MovarcTurnsByItsAngleRightHandedAboutItsNormal) {
  const auto arc_of = [](const std::string& arc, const std::string& end) {
    return read("GOTO/20,0,10\nMOVARC/0,0,10,0,0," + arc + "\nGOTO/" + end + "\n", with_shapes());
  };
  const auto quarter = arc_of("1,20,ANGLE,90", "0,20,10");
  ASSERT_EQ(joined(quarter.findings), "");
  EXPECT_NEAR(quarter.arcs().at(0).sweep.deg(), 90.0, 1e-9);
  EXPECT_NEAR((point_on(quarter.arcs()[0], 0.5) - Vec3(20, 20, 10 * std::sqrt(2.0)) / std::sqrt(2.0)).norm(),
              0.0, 1e-12);
  const auto clockwise = arc_of("-1,20,ANGLE,270.000001", "0,20,10");
  EXPECT_NEAR(clockwise.arcs().at(0).sweep.deg(), 270.0, 1e-9);
  EXPECT_NEAR(arc_of("1,20,ANGLE,360", "20,0,10").arcs().at(0).sweep.deg(), 360.0, 1e-9);
  EXPECT_NEAR(arc_of("1,20,ANGLE,810", "0,20,4").arcs().at(0).sweep.deg(), 810.0, 1e-9);
  // A post that leaves the normal of a clockwise arc as it is.
  EXPECT_EQ(
      joined(arc_of("1,20,ANGLE,270", "0,20,10").findings),
      "2:1: error: MOVARC: it turns by 270 deg, but the way to its end, right-handed about its normal, is 90 "
      "deg: the sense is not known\n");
  EXPECT_EQ(joined(arc_of("1,20,ANGLE,90.1", "0,20,10").findings).substr(0, 40),
            "2:1: error: MOVARC: it turns by 90.1 deg");
  EXPECT_EQ(joined(arc_of("1,21,ANGLE,90", "0,20,10").findings).substr(0, 37),
            "2:1: error: MOVARC: radius to its sta");
}

// CAMplete's eleven values: the sense of NX, degrees, and zeros.
TEST(Circle, ElevenValuesThatEndInZerosCarryTheirAngle) {
  const auto circle = [](const std::string& degrees, const std::string& end) {
    return read("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,-1,10," + degrees + ",0.0,0.0,0.0\nGOTO/" + end + "\n",
                with_shapes());
  };
  EXPECT_NEAR(circle("90.0", "0,10,0").arcs().at(0).sweep.deg(), 90.0, 1e-9);
  EXPECT_NEAR(circle("360.0", "10,0,0").arcs().at(0).sweep.deg(), 360.0, 1e-9);
  EXPECT_EQ(joined(circle("270.0", "0,10,0").findings).substr(0, 39),
            "2:1: error: CIRCLE: it turns by 270 deg");
}

TEST(Circle, ARampOfTurnsAndARestIsRefused) {
  EXPECT_EQ(
      joined(read("GOTO/-45,-12,16\nCIRCLE/0,0,13,0,0,-1,46.5725,.06,.5,20,1,TIMES,2\nGOTO/0,-46.5725,13\n")
                 .findings),
      "2:1: error: CIRCLE: TIMES with an end that is not at the start's angle: how the rest of a turn counts "
      "is documented nowhere (NX: Motion Output Type, Line)\n");
}

TEST(Circle, WhatWouldFillTheMemoryIsRefused) {
  ReaderOptions fine = test::in_mm();
  fine.arc_tolerance_mm = 1e-12;
  EXPECT_EQ(joined(read("GOTO/500,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/0,500,0\n", fine).findings),
            "3:1: error: an arc of 1.24e+07 chords within 1e-12 mm; at most 250000 are taken\n");
  EXPECT_EQ(
      joined(read("GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1,.06,.5,20,1,TIMES,4294967295\nGOTO/1,0,0\n").findings)
          .substr(0, 43),
      "2:40: error: CIRCLE: TIMES,4294967295 is no");
}

// The chords' distance from the true curve by dense sampling, not by the formula that made them.
TEST(Circle, LinearisedArcsStayWithinTheTolerance) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::uniform_real_distribution<double> exponent(-1.0, 4.0);
  std::uniform_real_distribution<double> turn(1.0, 720.0);
  for (int round = 0; round < 200; ++round) {
    Arc arc;
    arc.normal_P = Vec3(unit(random), unit(random), unit(random)).normalized();
    arc.center_P = 100.0 * Vec3(unit(random), unit(random), unit(random));
    const double radius = std::pow(10.0, exponent(random));
    const Vec3 across = arc.normal_P.cross(Vec3(unit(random), unit(random), unit(random))).normalized();
    arc.start_P = arc.center_P + radius * across;
    arc.sweep = Angle::degrees(turn(random));
    arc.end_P = arc.center_P + rotation_about(arc.normal_P, arc.sweep) * (radius * across) +
                arc.normal_P * (5.0 * unit(random));
    const double tolerance = std::pow(10.0, -1.0 + 3.0 * unit(random));
    const auto points = linearise(arc, tolerance);
    ASSERT_LE(points.size(), 2000000U);
    const double n = static_cast<double>(points.size());
    const std::size_t stride = std::max<std::size_t>(1, points.size() / 50);
    double worst = 0.0;
    for (std::size_t i = 0; i < points.size(); i += stride) {
      const Vec3 from = i == 0 ? arc.start_P : points[i - 1];
      for (const double t : {0.25, 0.5, 0.75}) {
        const Vec3 on_arc = point_on(arc, (static_cast<double>(i) + t) / n);
        worst = std::max(worst, distance_to_segment(on_arc, from, points[i]));
        EXPECT_NEAR(((on_arc - arc.center_P).cross(arc.normal_P)).norm(), radius, 1e-9 * radius + 1e-9);
      }
    }
    EXPECT_LE(worst, tolerance + 1e-9) << radius << " " << arc.sweep.deg();
    if (points.size() > 8) {
      EXPECT_GT(worst, 0.2 * tolerance);  // and no finer than needed
    }
    EXPECT_EQ(points.back(), arc.end_P);
  }
}

TEST(Circle, WithoutKeptArcsTheReaderGivesTheChords) {
  const auto reading = read("FEDRAT/60\nGOTO/10,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,0\nGOTO/0,20,0\n");
  const auto motions = reading.motions();
  ASSERT_GT(motions.size(), 30U);  // 90 deg of radius 10 mm within 1 um
  for (std::size_t i = 0; i + 1 < motions.size(); ++i) EXPECT_NEAR(motions[i].tip_P.norm(), 10.0, 1e-12);
  EXPECT_EQ(motions.back().tip_P, Vec3(0, 20, 0));
  EXPECT_EQ(motions[5].feed, (Feed{FeedMode::per_minute, 1.0}));
}

TEST(Circle, CutterCompensationIsRefusedUnlessTheFileIsOnCenter) {
  const std::string contour = "GOTO/0,0,0\nCUTCOM/LEFT\nGOTO/1,0,0\nCUTCOM/OFF\n";
  EXPECT_EQ(joined(read(contour).findings),
            "2:1: error: CUTCOM/LEFT changes the geometry: whether the points are those of the tool's center "
            "the file "
            "does not say (--cutter-compensation tool-center or wear)\n");
  EXPECT_EQ(joined(read("$$-> CUTCOM_GEOMETRY_TYPE / OUTPUT_ON_CENTER\n" + contour).findings),
            "3:1: warning: CUTCOM is left out: the points are those of the tool's center\n");
}

}  // namespace
}  // namespace trunnion::cl
