#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "cl/support.hpp"

namespace trunnion::cl {
namespace {

using test::joined;
using test::read;

struct Step {
  double z;
  bool rapid;
  bool operator==(const Step&) const = default;
};

std::vector<Step> steps(const test::Reading& reading, std::size_t first) {
  std::vector<Step> all;
  const auto motions = reading.motions();
  for (std::size_t i = first; i < motions.size(); ++i)
    all.push_back({motions[i].tip_P.z(), motions[i].rapid});
  return all;
}

std::ostream& operator<<(std::ostream& out, const Step& step) {
  return out << step.z << (step.rapid ? " rapid" : " feed");
}

// A tool that was changed is not where the one before stopped.
TEST(Cycle, TheFirstHoleBehindAToolChangeIsApproachedOverItself) {
  const auto reading = read(
      "LOADTL/4\nGOTO/5,0,-30,0,0,1\nLOADTL/7\nCYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,2\nGOTO/60,0,0\n"
      "GOTO/60,20,0\nCYCLE/OFF\nRAPID\nGOTO/60,20,40\n");
  ASSERT_EQ(joined(reading.findings), "");
  const auto motions = reading.motions();
  EXPECT_EQ(motions[1].tip_P, Vec3(60, 0, 2));
  EXPECT_EQ(
      steps(reading, 1),
      (std::vector<Step>{{2, true}, {-5, false}, {2, true}, {2, true}, {-5, false}, {2, true}, {40, true}}));
  // Over the hole itself, too.
  const auto same = read(
      "LOADTL/4\nGOTO/60,0,2,0,0,1\nLOADTL/7\nCYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,2\nGOTO/60,0,0\nCYCLE/"
      "OFF\n");
  EXPECT_EQ(steps(same, 1), (std::vector<Step>{{2, true}, {-5, false}, {2, true}}));
}

// One of two that contradict each other would be believed without a word.
TEST(Cycle, ValuesThatContradictEachOtherAreRefused) {
  const auto says = [](const std::string& cycle) {
    return joined(
        read("FEDRAT/MMPM,500\nGOTO/0,0,50,0,0,1\n" + cycle + "\nGOTO/0,0,0\nCYCLE/OFF\n").findings);
  };
  const std::string begin = "CYCLE/DRILL,FEDTO,10,MMPM,200,CLEAR,3";
  EXPECT_NE(says(begin + ",RTRCTO,45,RETURN,15").find("two ways to return"), std::string::npos);
  EXPECT_NE(says(begin + ",RETURN,15,RTRCTO,AUTO").find("two ways to return"), std::string::npos);
  EXPECT_NE(says(begin + ",RETURN,AUTO,RTRCTO,15").find("two ways to return"), std::string::npos);
  EXPECT_NE(says(begin + ",CLEAR,9").find("CLEAR stands twice"), std::string::npos);
  EXPECT_NE(says(begin + ",DEPTH,-20").find("two depths"), std::string::npos);
  EXPECT_NE(says(begin + ",IPM,3").find("a second feed"), std::string::npos);
  EXPECT_EQ(says(begin + ",RTRCTO,15,RETURN,15,DEPTH,-10"), "");
}

TEST(Cycle, ARapidUnderACycleIsToldOf) {
  const std::string holes =
      "LOADTL/4\nRAPID\nGOTO/0,0,40,0,0,1\nCYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,2\nGOTO/60,0,0\n";
  const std::string away = "RAPID\nGOTO/60,20,40\n";
  EXPECT_NE(joined(read(holes + away).findings).find("RAPID under CYCLE"), std::string::npos);
  EXPECT_EQ(joined(read(holes + "CYCLE/OFF\n" + away).findings), "");
}

TEST(Cycle, MotionsBehindUnloadAreToldOf) {
  const auto reading = read("LOADTL/4\nGOTO/5,0,30,0,0,1\nUNLOAD/TOOL\nGOTO/9,0,30\n");
  EXPECT_NE(joined(reading.findings).find("UNLOAD is not acted on"), std::string::npos)
      << joined(reading.findings);
  EXPECT_EQ(joined(read("LOADTL/4\nGOTO/5,0,30,0,0,1\nUNLOAD/TOOL\nLOADTL/5\nGOTO/9,0,30\n").findings), "");
}

TEST(Cycle, AHoleInEveryGrammar) {
  // NX (signed depth), SolidWorks, Creo couplets, CATIA, the fixed order.
  for (const std::string cycle :
       {"CYCLE/DRILL,RAPTO,3.0,FEDTO,-12.5,RTRCTO,10.0,MMPM,60.0",
        "CYCLE/INIT\nCYCLE/DRILL,FEDTO,12.5,MMPM,60,RAPTO,3.,RTRCTO,10.,DWELL,0",
        "CYCLE / DRILL, DEPTH, 12.5, MMPM, 60.0, CLEAR, 3.0, RETURN, 10.0",
        "CYCLE/DRILL,DEPTH,    12.5,MMPM,    60.0,CLEAR,    3.0,$\nRETURN,   10.0",
        "CYCLE/DRILL, 12.5, MMPM, 60, 3.0, RETURN, 10", "CYCLE/DRILL,12.5,60.,MMPM,3.,RETURN,10",
        "CYCLE/DRILL, FEDTO, 12.5, MMPM, 60, CLEAR, 50, RTRCTO, 10, RETURN, 10, RAPTO, 3",
        "CYCLE/DRILL, RAPTO, 3, FEDTO, 12.5, MMPM, 60, CLEAR, 50, RETURN, 10"}) {
    const auto reading =
        read("GOTO/0,0,50,0,0,1\n" + cycle + "\nGOTO/5,0,0\nGOTO/5,5,1\nCYCLE/OFF\nRAPID\nGOTO/5,5,50\n");
    ASSERT_EQ(joined(reading.findings), "") << cycle;
    EXPECT_EQ(steps(reading, 1), (std::vector<Step>{{50, true},
                                                    {3, true},
                                                    {-12.5, false},
                                                    {10, true},  // across, down, hole, out
                                                    {11, true},  // up to the next return height
                                                    {11, true},
                                                    {4, true},
                                                    {-11.5, false},
                                                    {11, true},
                                                    {50, true}}))
        << cycle;
    const auto motions = reading.motions();
    EXPECT_EQ(motions[3].feed, (Feed{FeedMode::per_minute, 1.0}));
    EXPECT_EQ(motions[1].tip_P, Vec3(5, 0, 50));
    EXPECT_EQ(motions[5].tip_P, Vec3(5, 0, 11));  // up before across
    EXPECT_EQ(motions[6].tip_P, Vec3(5, 5, 11));
  }
}

TEST(Cycle, ATiltedHoleGoesAlongTheToolAxis) {
  const auto reading =
      read("GOTO/0,0,100,0.6,0,0.8\nCYCLE/DRILL,FEDTO,10,RAPTO,2,RTRCTO,5,MMPM,60\nGOTO/1,2,3\n");
  const auto motions = reading.motions();
  const Vec3 axis(0.6, 0, 0.8);
  EXPECT_NEAR((motions[3].tip_P - (Vec3(1, 2, 3) - 10 * axis)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((motions[4].tip_P - (Vec3(1, 2, 3) + 5 * axis)).norm(), 0.0, 1e-12);
  for (const Motion& motion : motions) EXPECT_NEAR((motion.axis_P - axis).norm(), 0.0, 1e-12);
}

TEST(Cycle, PecksGoOnWhereTheyStoppedAndReachTheBottom) {
  const auto reading = read(
      "GOTO/0,0,20\nCYCLE/DEEP2,FEDTO,10.,1STPECK,5.,SUBPECK,2.,MMPM,60,RAPTO,3.,RTRCTO,3.\nGOTO/0,0,0\n");
  ASSERT_EQ(joined(reading.findings), "");
  EXPECT_EQ(steps(reading, 1), (std::vector<Step>{{3, true},
                                                  {-5, false},
                                                  {3, true},
                                                  {-4, true},
                                                  {-7, false},
                                                  {3, true},
                                                  {-6, true},
                                                  {-9, false},
                                                  {3, true},
                                                  {-8, true},
                                                  {-10, false},
                                                  {3, true}}));
}

TEST(Cycle, ReturnAutoGoesBackToWhereItCameFrom) {
  const auto reading =
      read("GOTO/0,0,20\nCYCLE/FACE,RAPTO,3.,FEDTO,-5.,RTRCTO,AUTO,MMPM,60,DWELL,0.5\nGOTO/0,0,0\n");
  EXPECT_EQ(steps(reading, 1), (std::vector<Step>{{3, true}, {-5, false}, {20, true}}));
  EXPECT_EQ(reading.all<Dwell>().at(0).seconds, 0.5);
}

// CATIA: depth, clearance. That it is so shows where the tool stands above the first hole.
TEST(Cycle, AClearanceByPlaceIsTakenWhereTheToolStandsThere) {
  const auto reading =
      read("FEDRAT/60\nGOTO/9,9,25\nCYCLE/DRILL,3.,5.\nGOTO/9,9,20\nGOTO/19,9,20\nCYCLE/OFF\n");
  ASSERT_EQ(joined(reading.findings), "");
  EXPECT_EQ(steps(reading, 1),
            (std::vector<Step>{{17, false}, {25, true}, {25, true}, {17, false}, {25, true}}));
  EXPECT_EQ(
      joined(read("GOTO/9,9,23\nCYCLE/DRILL,3.,5.\nGOTO/9,9,20\n").findings),
      "3:1: error: CYCLE: is the value behind its depth, 5 mm, the clearance? The tool does not stand there "
      "above this hole (words are needed: DEPTH, CLEAR)\n");
}

// Their GOTO is the bottom of the hole, their clearance an absolute height.
TEST(Cycle, ValuesByPlaceAreRefusedInFilesOfFusion) {
  const auto verdict = joined(
      read("MODE/MILL\nGOTO/9,9,40\nCYCLE/DRILL, 20., MMPM, 200., 15., RAPTO, 10.\nGOTO/9,9,0\n").findings);
  EXPECT_EQ(verdict.substr(0, 63), "3:14: error: CYCLE: values without words, as Fusion and HSMWork");
  EXPECT_EQ(joined(read("GOTO/9,9,40\nCYCLE/DRILL,20.,MMPM,200.,15.,RAPTO,10.\nGOTO/9,9,0\n").findings),
            "2:31: error: CYCLE: RAPTO behind a clearance without a word\n");
}

// In at its pitch, out at its pitch, and always told of as what it is.
TEST(Cycle, AThreadIsCutInAndOut) {
  for (const std::string cycle : {"CYCLE/TAP,RAPTO,3.0,FEDTO,-12.5,RTRCTO,10.0,MMPR,1.25",
                                  "CYCLE / TAP, DEPTH, 12.5, MMPR, 1.25, CLEAR, 3.0, RETURN, 10.0",
                                  "FEDRAT/MMPR,1.25\nCYCLE/TAP,DEPTH,12.5,CLEAR,3,RETURN,10,DWELL,0"}) {
    const auto reading = read("GOTO/0,0,50,0,0,1\n" + cycle + "\nGOTO/5,0,0\nCYCLE/OFF\n");
    ASSERT_EQ(joined(reading.findings), "") << cycle;
    EXPECT_EQ(steps(reading, 1),
              (std::vector<Step>{{50, true}, {3, true}, {-12.5, false}, {3, false}, {10, true}}))
        << cycle;
    EXPECT_EQ(reading.motions()[3].feed, (Feed{FeedMode::per_revolution, 1.25}));
    std::size_t shapes = 0;
    for (const Record& record : reading.records) {
      const auto* begin = std::get_if<ShapeBegin>(&record.data);
      if (begin == nullptr) continue;
      ++shapes;
      EXPECT_EQ(begin->shape->motions, 5u);
      EXPECT_EQ(std::get<Hole>(begin->shape->what).kind, Hole::Kind::tap);
    }
    EXPECT_EQ(shapes, 1u) << cycle;
  }
}

TEST(Cycle, WhatAControlAloneCanDoIsRefused) {
  const auto error_of = [](const std::string& cycle) {
    return joined(read("GOTO/0,0,9\n" + cycle + "\nGOTO/0,0,0\n").findings);
  };
  EXPECT_EQ(error_of("CYCLE/MILL,DEPTH,5,IPR,.1,CLEAR,1"),
            "2:7: error: CYCLE: MILL changes the geometry and is not understood by this program\n");
  EXPECT_EQ(error_of("FEDRAT/MMPM,500\nCYCLE/TAP,DEPTH,5,CLEAR,1").substr(0, 39),
            "3:1: error: CYCLE: TAP without a pitch:");
  EXPECT_EQ(error_of("CYCLE/TAP,DEPTH,5,MMPR,1,CLEAR,1,STEP,2"),
            "2:1: error: CYCLE: TAP in steps is not understood by this program\n");
  EXPECT_EQ(error_of("CYCLE/TAP,DEPTH,5,MMPR,1,CLEAR,1,DWELL,2").substr(0, 36),
            "2:1: error: CYCLE: TAP with a dwell ");
  EXPECT_EQ(error_of("CYCLE/TAP,DEEP,DEPTH,5,MMPR,1,CLEAR,1"),
            "2:11: error: CYCLE: 'DEEP' is not understood\n");
  EXPECT_EQ(error_of("CYCLE/DRILL,MMPM,100"), "2:1: error: CYCLE: no depth (DEPTH or FEDTO)\n");
  EXPECT_EQ(error_of("CYCLE/DRILL,DEPTH,5,MMPM,100").substr(0, 54),
            "2:1: error: CYCLE: no clearance (CLEAR or RAPTO): the ");
  EXPECT_EQ(error_of("CYCLE/REAM,DEPTH,5,CLEAR,1,STEP,2").substr(0, 38),
            "2:1: error: CYCLE: steps of a hole tha");
  EXPECT_EQ(error_of("CYCLE/DRILL,DEPTH,5,FOO,1"), "2:21: error: CYCLE: 'FOO' is not understood\n");
  EXPECT_EQ(error_of("CYCLE/DRILL,DEPTH,5,CLEAR,-1"),
            "2:1: error: CYCLE: a clearance, return, step or dwell below 0\n");
  EXPECT_EQ(error_of("CYCLE/DRILL,DEEP,RAPTO,3.0,FEDTO,2.0,MMPM,250.0"),
            "2:1: warning: CYCLE: no step is given: each hole is drilled in one go\n");
}

TEST(Cycle, OfOneToolIsNotThatOfTheNext) {
  const std::string holes = "LOADTL/4\nGOTO/0,0,50\nCYCLE/DRILL,DEPTH,10,CLEAR,2,MMPM,100\nGOTO/10,0,0\n";
  const std::string next = "LOADTL/5\nRAPID\nGOTO/0,0,30\nGOTO/0,0,-1\n";
  EXPECT_EQ(joined(read(holes + next).findings),
            "5:1: error: a tool is loaded while CYCLE is in force: CYCLE/OFF is missing before it\n");
  EXPECT_EQ(joined(read(holes + "CYCLE/OFF\n" + next).findings), "");
  EXPECT_EQ(joined(read(holes + "TOOL PATH/MILL,TOOL,T4\nGOTO/0,0,-1\nEND-OF-PATH\n").findings),
            "5:1: error: an operation begins while CYCLE is in force: CYCLE/OFF is missing before it\n");
}

TEST(Cycle, StepsArePecksUnderDrill) {
  const auto reading = read("GOTO/0,0,50,0,0,1\nCYCLE/DRILL,DEPTH,10,CLEAR,3,STEP,5,MMPM,100\nGOTO/5,0,0\n");
  EXPECT_EQ(steps(reading, 1),
            (std::vector<Step>{
                {50, true}, {3, true}, {-5, false}, {3, true}, {-4, true}, {-10, false}, {3, true}}));
}

// 1 mm at 500 rpm, 1.25 mm with the same feed at 400.
TEST(Cycle, OneTapCutsOnePitch) {
  const std::string head =
      "GOTO/0,0,50,0,0,1\nSPINDL/500,RPM,CLW\nCYCLE/TAP,DEPTH,10,CLEAR,3,MMPM,500\nGOTO/5,0,0\n";
  EXPECT_EQ(joined(read(head + "SPINDL/500,RPM,CLW\nGOTO/9,0,0\n").findings), "");
  EXPECT_NE(joined(read(head + "SPINDL/400,RPM,CLW\nGOTO/9,0,0\n").findings)
                .find("is a pitch of 1.25 mm, and the hole before was cut with 1 mm"),
            std::string::npos);
  EXPECT_EQ(
      joined(read(head + "SPINDL/400,RPM,CLW\nCYCLE/TAP,DEPTH,10,CLEAR,3,MMPM,400\nGOTO/9,0,0\n").findings),
      "");
}

// Around a ring the straight way from hole to hole is through the part.
TEST(Cycle, BetweenHolesOfOtherAxesTheToolLeavesThePart) {
  const auto reading = read(
      "GOTO/0,0,60,0,0,1\nCYCLE/DRILL,DEPTH,10,CLEAR,3,MMPM,100\nGOTO/0,0,20,0,0,1\nGOTO/9,0,20\n"
      "GOTO/0,-40,0,0,-0.7071068,0.7071068\n");
  ASSERT_EQ(joined(reading.findings), "");
  const auto words = reading.all<PostWord>();
  ASSERT_EQ(words.size(), 1U);
  EXPECT_EQ(words[0].word, "RETRCT");
  const auto at = std::find_if(reading.records.begin(), reading.records.end(),
                               [](const Record& r) { return std::holds_alternative<PostWord>(r.data); });
  EXPECT_EQ(at->where.line, 5U);
  const auto& next = std::get<Motion>(std::next(at)->data);
  EXPECT_TRUE(next.rapid);
  EXPECT_NEAR((next.tip_P - Vec3(0, -40 - 3 * std::sqrt(0.5), 3 * std::sqrt(0.5))).norm(), 0.0, 1e-6);
}

}  // namespace
}  // namespace trunnion::cl
