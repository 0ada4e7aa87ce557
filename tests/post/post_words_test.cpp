// ROTABL, ROTATE, LIMITS, MAXDPM, CLEARP, RETRCT and LINTOL in the CL file.
#include <cmath>
#include <gtest/gtest.h>

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

using test::posted;

// Round the table at 30 deg of tilt, from `from_deg` to `to_deg`.
std::string arc_of_points(double from_deg, double to_deg, int count) {
  std::string cl;
  for (int i = 0; i <= count; ++i) {
    const double turn = (from_deg + (to_deg - from_deg) * i / count) * kRadPerDegree;
    cl += "GOTO/" + fixed_text(30 * std::cos(turn), 5) + "," + fixed_text(30 * std::sin(turn), 5) + ",0," +
          fixed_text(0.5 * std::cos(turn), 9) + "," + fixed_text(0.5 * std::sin(turn), 9) + "," +
          fixed_text(std::sqrt(0.75), 9) + "\n";
  }
  return cl;
}

double extreme_c(const Machine& machine, const VerifyReport& v, double sign) {
  double out = -1e9;
  for (const auto& block : v.blocks) out = std::max(out, sign * block.q[*machine.axis("C")]);
  return sign * out * kDegreePerRad;
}

bool warned(const test::Posted& p, const std::string& text) {
  for (const auto& finding : p.diagnostics.findings()) {
    if (finding.text().find(text) != std::string::npos) return true;
  }
  return false;
}

TEST(PostWords, LimitsNarrowTheTravelFromThereOn) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.axes[3].min = 0.0;
  PostOptions options;
  options.collect = true;
  const std::string path = "FEDRAT/MMPM,900\nRAPID\n" + arc_of_points(-90, 300, 130);
  const auto free = posted(path, machine, options);
  ASSERT_TRUE(free.report) << free.report.error().text();
  EXPECT_EQ(free.report->choice.reconfigurations, 0U);
  const auto p = posted("LIMITS/CAXIS,-200.,200.\n" + path, machine, options);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(p.report->choice.reconfigurations, 1U);
  EXPECT_GE(extreme_c(machine, *p.report->verification, -1.0), -200.0001);
  EXPECT_LE(extreme_c(machine, *p.report->verification, 1.0), 200.0001);
  EXPECT_TRUE(p.report->verification->passed());
  // Linear travel in the file's unit, and a limit that no path keeps is an error with the axis and the line.
  const auto inch =
      posted("UNITS/INCHES\nLIMITS/XAXIS,-1.,1.\nFEDRAT/40,IPM\nGOTO/0,0,0\nGOTO/1.5,0,0\n", machine);
  ASSERT_FALSE(inch.report);
  EXPECT_EQ(inch.report.error().text(),
            "part.cls:5:1: error: axis X would have to go to 38.1000 mm, 12.7000 mm beyond its limits of "
            "-25.4000 mm to 25.4000 mm");
  EXPECT_TRUE(
      posted("UNITS/MM\nLIMITS/XAXIS,-1.,1.\nLIMITS/OFF\nFEDRAT/40,IPM\nGOTO/0,0,0\nGOTO/1.5,0,0\n", machine)
          .report);
  EXPECT_TRUE(
      warned(posted("LIMITS/XAXIS\nFEDRAT/9,MMPM\nGOTO/0,0,0\n", machine), "LIMITS/XAXIS is not acted on"));
}

TEST(PostWords, MaxdpmHoldsTheRotaryAxesBack) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string path = "FEDRAT/MMPM,5000\nRAPID\n" + arc_of_points(0, 90, 45);
  const auto free = posted(path, machine);
  const auto p = posted("MAXDPM/300\n" + path, machine);
  ASSERT_TRUE(free.report && p.report);
  EXPECT_GT(p.report->feed_time_lost_s, 10.0);
  EXPECT_LT(free.report->feed_time_lost_s, 1.0);
  EXPECT_TRUE(p.report->verification->passed());
  // 90 degrees of C at 300 a minute: read back from the text.
  EXPECT_GT(p.report->verification->duration_s, 18.0 - 0.01);
}

TEST(PostWords, MeasureIsSwitchedInTheFile) {
  // PostWorks' example: {50, 90} against {110, 0}: the largest travel prefers the one, the sum the other.
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string head = "FEDRAT/MMPM,900\n";
  for (const char* form : {"COMBIN", "LARGE", "PLUS", "AXIS,1", "AXIS,2"}) {
    const auto p = posted("ROTABL/SHORT," + std::string(form) + "\n" + head + test::sample_path(3), machine);
    ASSERT_TRUE(p.report) << form << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed()) << form;
    EXPECT_FALSE(warned(p, "not acted on")) << form;
    PostOptions options;
    options.choice = std::string(form) == "COMBIN"  ? path::ChoiceMethod::combined
                     : std::string(form) == "LARGE" ? path::ChoiceMethod::largest
                     : std::string(form) == "PLUS"  ? path::ChoiceMethod::sum
                                                    : path::ChoiceMethod::axis;
    options.choice_axis = std::string(form) == "AXIS,1" ? "A" : "C";
    EXPECT_EQ(p.nc, posted(head + test::sample_path(3), machine, options).nc) << form;
  }
  EXPECT_TRUE(warned(posted("ROTABL/SHORT,WIDE\n" + head + "GOTO/0,0,0\n", machine), "not acted on"));
}

TEST(PostWords, TableTurnsAtTheSafeHeightAndStaysAtThePole) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  PostOptions options;
  options.collect = true;
  const std::string cut = "RAPID\nGOTO/10,0,30\nGOTO/10,0,0\nGOTO/20,0,0\nRAPID\nGOTO/20,0,30\n";
  for (const auto& [word, angle] :
       std::vector<std::pair<std::string, double>>{{"ROTABL/ATANGL,90.", 90.0},
                                                   {"ROTABL/AXIS,2,ATANGL,90.,CLW", 90.0},
                                                   {"ROTABL/90.,,TABLE,CCLW", -270.0},
                                                   {"ROTATE/CAXIS,ATANGL,-30,INCR", -30.0},
                                                   {"ROTATE/CAXIS,ABSOL,CLW,45", 45.0},
                                                   {"ROTABL/INCR,-30", -30.0}}) {
    const auto p = posted("FEDRAT/MMPM,900\n" + cut + word + "\n" + cut, machine, options);
    ASSERT_TRUE(p.report) << word << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed()) << word << " " << p.nc;
    EXPECT_NEAR(p.report->verification->blocks.back().q[*machine.axis("C")] * kDegreePerRad, angle, 1e-3)
        << word;
    EXPECT_NE(p.nc.find("G53"), p.nc.rfind("G53")) << word;
  }
}

// What is cut next begins where the tool was: to come down at its end would plunge, and leave its way uncut.
TEST(PostWords, CutsOnFromWhereItWasWhenTheTableHasTurned) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string up = "RAPID\nGOTO/10,0,30,0,0,1\nFEDRAT/900,MMPM\nGOTO/10,0,0\nROTATE/CAXIS,ATANGL,60\n";
  const std::string leaned =
      "RAPID\nGOTO/10,0,30,0,0.6,0.8\nFEDRAT/900,MMPM\nGOTO/10,0,0\nROTATE/CAXIS,ATANGL,300\n";
  for (const auto& [cl, turned] :
       {std::pair{up + "GOTO/10,0,-5\nGOTO/20,0,-5\n", true}, std::pair{up + "GOTO/20,0,0\n", true},
        std::pair{up + "STOP\nGOTO/20,0,0\n", true},
        std::pair{std::string(up).insert(up.rfind('\n'), ",NEXT") + "GOTO/20,0,0\n", true},
        std::pair{up + "GOTO/20,0,0,0,0.05,0.998749218\n", false}, std::pair{leaned + "GOTO/20,0,0\n", false},
        std::pair{leaned + "GOTO/20,0,0,0.1,0.6,0.793725393\n", false}}) {
    for (const bool rtcp : {false, true}) {
      for (const bool tilted : {false, true}) {
        PostOptions options;
        options.collect = true;
        options.rtcp = rtcp;
        options.tilted_plane = tilted;
        if (rtcp && tilted) continue;
        const auto p = posted("LOADTL/1,LENGTH,100\n" + cl + "RAPID\nGOTO/20,0,60\n", machine, options,
                              tilted ? "siemens_840d_sl" : "linuxcnc");
        ASSERT_TRUE(p.report) << cl << rtcp << tilted << p.report.error().text();
        ASSERT_TRUE(p.report->verification->passed()) << cl << rtcp << tilted << p.nc;
        // Down to where it left the path, and to nowhere else beside it.
        std::size_t there = 0;
        for (const auto& block : p.report->verification->blocks) {
          if (!block.rapid && (block.tip_P - Vec3(10, 0, 0)).norm() < 1e-3) ++there;
        }
        EXPECT_EQ(there, 2U) << cl << rtcp << tilted << p.nc;
        EXPECT_EQ(warned(p, "the tool axis of the next point"), !turned) << cl;
      }
    }
  }
}

// Another solution of the rotary axes, a turn of both axes at the pole, a turn of nothing, a word that begins
// a run of points in a tilted plane: nothing of the cut is left out, and C does not turn in it.
TEST(PostWords, CutsOnHoweverTheTableHasTurned) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto down = [](const std::string& axis) {
    return "LOADTL/1,LENGTH,100\nRAPID\nGOTO/10,0,60," + axis + "\nFEDRAT/900,MMPM\nGOTO/10,0,0\n";
  };
  const std::string up = "RAPID\nGOTO/20,0,60\n";
  const std::string little = "0,0.087155743,0.996194698", much = "0,0.6,0.8";
  for (const std::string& cl :
       {down(little) + "ROTATE/CAXIS,ATANGL,180\nGOTO/20,0,0\n" + up,
        down(little) + "ROTATE/CAXIS,ATANGL,180\nGOTO/20,0,0,0.01,0.087155743,0.996144495\n" + up,
        down("0,0,1") + "ROTATE/AAXIS,ATANGL,30\nROTATE/CAXIS,ATANGL,90\nGOTO/20,0,0\n" + up,
        down("0,0,1") + "ROTATE/AAXIS,ATANGL,0\nROTATE/CAXIS,ATANGL,300\nGOTO/20,0,0\n" + up,
        down(much) + "ROTATE/CAXIS,ATANGL,0\nGOTO/20,0,0,0.1,0.6,0.793725393\n" + up,
        down(much) + "CLEARP/XYPLAN,90\nGOTO/20,0,0,0.1,0.6,0.793725393\n" + up,
        down(much) + "LIMITS/CAXIS,-360,360\nGOTO/20,0,0,0.1,0.6,0.793725393\n" + up}) {
    for (const char* mode : {"joint", "tcp", "plane"}) {
      PostOptions options;
      options.collect = true;
      options.rtcp = mode == std::string("tcp");
      options.tilted_plane = mode == std::string("plane");
      const auto p = posted(cl, machine, options, options.tilted_plane ? "fanuc_30i" : "linuxcnc");
      ASSERT_TRUE(p.report) << cl << mode << p.report.error().text();
      ASSERT_TRUE(p.report->verification->passed()) << cl << mode << p.nc;
      if (cl.find(",0,0,1\n") == std::string::npos) continue;
      const auto& blocks = p.report->verification->blocks;
      for (std::size_t i = 1; i < blocks.size(); ++i) {
        if (blocks[i].rapid) continue;
        EXPECT_NEAR(blocks[i].q[*machine.axis("C")], blocks[i - 1].q[*machine.axis("C")], 1e-6)
            << cl << mode << p.nc;
      }
    }
  }
}

// A file that counts on points turning with the table would be cut upright.
TEST(PostWords, TurnThatTheNextPointUndoesIsToldOf) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string up = "FEDRAT/MMPM,900\nRAPID\nGOTO/10,0,30\nGOTO/10,0,0\nROTATE/AAXIS,ABSOL,60\n";
  const auto undone = posted(up + "RAPID\nGOTO/10,0,30\nGOTO/10,0,0\n", machine, {});
  ASSERT_TRUE(undone.report) << undone.report.error().text();
  EXPECT_TRUE(warned(
      undone, "axis A turns to 60.000 deg, and the tool axis of the next point turns it to 0.000 deg"));
  const auto meant =
      posted(up + "RAPID\nGOTO/10,26,15,0,0.866025404,0.5\nGOTO/10,0,0,0,0.866025404,0.5\n", machine, {});
  ASSERT_TRUE(meant.report) << meant.report.error().text();
  EXPECT_FALSE(warned(meant, "the tool axis of the next point"));
}

TEST(PostWords, ClearancePlaneIsWhereTheToolLeavesTo) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.axes[4].cyclic = false;
  machine.axes[4].min = -200.0 * kRadPerDegree;
  machine.axes[4].max = 200.0 * kRadPerDegree;
  machine.axes[3].min = 0.0;
  PostOptions options;
  options.collect = true;
  const auto p =
      posted("CLEARP/XYPLAN,70\nFEDRAT/MMPM,900\nRAPID\n" + arc_of_points(0, 420, 140), machine, options);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(p.report->choice.reconfigurations, 1U);
  EXPECT_TRUE(p.report->verification->passed());
  std::size_t there = 0;
  for (const auto& block : p.report->verification->blocks)
    there += std::abs(block.tip_P.z() - 70.0) < 1e-3 ? 1U : 0U;
  EXPECT_GE(there, 2U);  // out, and back in
}

TEST(PostWords, RetractGoesAlongTheToolAxisToThePlane) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  PostOptions options;
  options.collect = true;
  const auto p = posted(
      "CLEARP/XYPLAN,50\nFEDRAT/MMPM,900\nRAPID\nGOTO/10,0,30,0.6,0,0.8\nGOTO/"
      "10,0,2,0.6,0,0.8\nRETRCT\nRAPID\n"
      "GOTO/90,0,50,0.6,0,0.8\n",
      machine, options);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
  const auto& blocks = p.report->verification->blocks;
  EXPECT_LT((blocks[blocks.size() - 2].tip_P - Vec3(46, 0, 50)).norm(), 1e-3);
  // The same plane, a x + b y + c z = d told from below.
  const std::string up = "FEDRAT/MMPM,900\nRAPID\nGOTO/10,0,30\nGOTO/10,0,2\nRETRCT\nRAPID\nGOTO/90,0,50\n";
  EXPECT_EQ(posted("CLEARP/0,0,-1,-50\n" + up, machine, options).nc,
            posted("CLEARP/0,0,1,50\n" + up, machine, options).nc);
  EXPECT_EQ(posted("FEDRAT/9,MMPM\nGOTO/0,0,0\nRETRCT\n", machine).report.error().text(),
            "part.cls:3:1: error: RETRCT: there is no clearance plane (CLEARP) before it, in this frame");
}

TEST(PostWords, ToleranceInTheFileIsActedOnAndNeverLoosens) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  PostOptions options;
  options.tolerance_mm = 0.02;
  const std::string path = test::sample_path(3);
  const auto loose = posted(path, machine, options);
  const auto tight = posted("LINTOL/0.001\n" + path, machine, options);
  const auto wide = posted("LINTOL/0.5\n" + path, machine, options);
  ASSERT_TRUE(loose.report && tight.report && wide.report);
  EXPECT_LE(tight.report->verification->certified_tip_deviation_mm, 0.001 + 1e-9);
  EXPECT_GT(loose.report->verification->certified_tip_deviation_mm, 0.001);
  EXPECT_EQ(wide.report->points_inserted, loose.report->points_inserted);
}

}  // namespace
}  // namespace trunnion::post
