#include "trunnion/post/post.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <sstream>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

using test::Posted;
using test::posted;
using test::sample_path;
using test::verified;
using Text = test::TextOf;

TEST(Post, ProgramsAreWithinToleranceOnEveryMachine) {
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    for (unsigned seed = 1; seed <= 5; ++seed) {
      PostOptions options;
      options.tolerance_mm = seed % 2 == 0 ? 0.002 : 0.01;
      const Posted p = posted(sample_path(seed), machine, options);
      ASSERT_TRUE(p.report) << name << " " << p.report.error().text();
      const VerifyReport& v = *p.report->verification;
      EXPECT_TRUE(v.passed()) << name << " seed " << seed << " tip " << v.certified_tip_deviation_mm
                              << " missed " << v.points_missed;
      EXPECT_EQ(v.points_in, 60u);
      EXPECT_GT(p.report->points_inserted, 0u);
    }
  }
}

std::size_t blocks_at_cl_points(const VerifyReport& v) {
  return static_cast<std::size_t>(
      std::count_if(v.blocks.begin(), v.blocks.end(), [](const VerifiedBlock& b) { return b.programmed; }));
}

// One block at each of the 60 CL points: with inserted points between, compensated, and where the machine's
// errors put the tool 60 um beside its path.
TEST(Verify, KnowsTheBlocksThatEndAtClPoints) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  Diagnostics d;
  const auto model = parse_model(
      "[model]\nname = \"m\"\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 60.0\n",
      "m.toml", machine, {}, d);
  ASSERT_TRUE(model) << model.error().text();
  const ModelEvaluator errors(*model);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    PostOptions options;
    options.collect = true;
    options.tolerance_mm = 0.002;
    const Posted nominal = posted(sample_path(seed), machine, options);
    const Posted compensated = posted(sample_path(seed), machine, options, "linuxcnc", &*model);
    ASSERT_TRUE(nominal.report && compensated.report);
    EXPECT_GT(nominal.report->points_inserted, 0U);
    EXPECT_EQ(blocks_at_cl_points(*nominal.report->verification), 60U) << seed;
    EXPECT_EQ(blocks_at_cl_points(*compensated.report->verification), 60U) << seed;
    const nc::Controller c = test::shipped_controller("linuxcnc");
    VerifyOptions beside;
    beside.truth = &errors;
    beside.collect = true;
    const auto v = verify({std::make_unique<Text>(sample_path(seed)), "part.cls"},
                          {std::make_unique<Text>(nominal.nc), "part.nc"}, {machine, c, beside}, d);
    ASSERT_TRUE(v) << v.error().text();
    EXPECT_EQ(blocks_at_cl_points(*v), 60U) << seed;
    double seconds = 0.0;
    for (const VerifiedBlock& b : v->blocks) seconds += b.seconds;
    EXPECT_NEAR(seconds, v->duration_s, 1e-6 * v->duration_s);
  }
}

TEST(Post, WithoutInsertionTheVerificationFails) {
  PostOptions options;
  options.tolerance_mm = 0.002;
  options.nonlinear.method = path::Method::none;
  const Posted p = posted(sample_path(1), test::shipped_machine("trunnion_offset"), options);
  ASSERT_TRUE(p.report);
  EXPECT_FALSE(p.report->verification->passed());
  EXPECT_EQ(verdict_text(*p.report).substr(0, 20), "NOT WITHIN TOLERANCE");
  EXPECT_EQ(verdict_text(*p.report).size(), verdict_placeholder().size());
  EXPECT_NE(p.nc.find(verdict_placeholder()), std::string::npos);
}

// A remark of the CL file that says what the header's verdict says.
TEST(Post, NoTextOfTheClFileIsTakenForTheVerdict) {
  const std::string cl = "PPRINT WITHIN TOLERANCE: 0.000000 OF 0.010000 MM\nPPRINT " + verdict_placeholder() +
                         "\nPPRINT " + std::string(70, 'x') + " " + verdict_placeholder() + "\nPPRINT (" +
                         verdict_placeholder() + "\n" + sample_path(1);
  for (const std::string& control : test::shipped_controllers()) {
    const auto c = test::shipped_controller(control);
    const Posted p = posted(cl, test::shipped_machine("trunnion_offset"), {}, control);
    ASSERT_TRUE(p.report) << control << p.report.error().text();
    std::size_t verdicts = 0;
    std::istringstream lines(p.nc);
    for (std::string line; std::getline(lines, line);) {
      const auto open = line.find(c.comments.open);
      if (open == std::string::npos) continue;
      const auto text = line.find_first_not_of(' ', open + c.comments.open.size());
      if (text == std::string::npos) continue;
      EXPECT_NE(line.compare(text, 6, "WITHIN"), 0) << control << ": " << line;
      if (line.compare(text, 12, "VERIFICATION") == 0) ++verdicts;
    }
    EXPECT_EQ(verdicts, 1U) << control;
  }
}

// A machine without it, or a file that does not know it: flood instead would burn the tool.
TEST(Post, CoolantWithoutWordsNamesLineKeyAndFile) {
  const std::string cl = "UNITS/MM\nLOADTL/1\nCOOLNT/THRU\n" + sample_path(1);
  const Posted p = posted(cl, test::shipped_machine("trunnion_offset"));
  ASSERT_FALSE(p.report);
  const std::string text = p.report.error().text();
  EXPECT_EQ(
      text.find(
          "part.cls:3:1: error: LinuxCNC: the controller file has no words for coolant through the tool: "
          "[coolant] through_tool in "),
      0U)
      << text;
  EXPECT_NE(text.find("linuxcnc.toml"), std::string::npos) << text;
}

// Every word of the program matters. One word of a cut is changed at a time: a linear one by `by_mm`, a
// rotary one by 0.1 degrees (twice the axis tolerance).
void expect_every_changed_word_is_found(path::Method method, double by_mm) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = sample_path(3);
  PostOptions options;
  options.nonlinear.method = method;
  const Posted p = posted(cl, machine, options);
  ASSERT_TRUE(verified(p.nc, cl, machine, 0.01)->passed());
  std::mt19937_64 random(4);
  int changed = 0;
  for (int i = 0; i < 200; ++i) {
    std::string text = p.nc;
    const auto start = text.find("G93");
    std::size_t at = std::uniform_int_distribution<std::size_t>(start, text.size() - 40)(random);
    at = text.find_first_of("XYZAC", at);
    if (at == std::string::npos) continue;
    const auto end = text.find_first_of(" \n", at);
    const auto number = parse_number(std::string_view(text).substr(at + 1, end - at - 1));
    if (!number) continue;
    const bool rapid =
        text.rfind("G0", at) > text.rfind("G1", at) && text.rfind("G0", at) != std::string::npos;
    if (rapid) continue;
    const double by = text[at] == 'A' || text[at] == 'C' ? 0.1 : by_mm;
    text.replace(at + 1, end - at - 1, fixed_text(number.value + by, 4));
    const auto v = verified(text, cl, machine, 0.01);
    ASSERT_TRUE(v);
    EXPECT_FALSE(v->passed()) << p.nc.substr(at, end - at);
    ++changed;
  }
  EXPECT_GT(changed, 100);
}

// On the chord two tolerances lead a point out of the tube, whichever way they go.
TEST(Verify, FindsASingleWrongWord) {
  expect_every_changed_word_is_found(path::Method::reinsert, 0.02);
}

// A node that stands at one edge of the tube may come to the other one by two tolerances, and be within the
// tolerance there: no judge of deviations can tell (changed_word_test.cpp holds the verdicts against
// samples).
TEST(Verify, FindsASingleWrongWordOfAProgramOnBothSidesOfTheTube) {
  expect_every_changed_word_is_found(path::Method::adaptive, 0.03);
}

TEST(Verify, FindsMissingBlocksAndAWrongEnd) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = sample_path(3);
  std::string text = posted(cl, machine).nc;
  const auto end = text.rfind("\nX");
  const auto cut = text.rfind("\nX", end - 400);
  std::string shorter = text.substr(0, cut + 1) + text.substr(text.find('\n', end + 1) + 1);
  EXPECT_FALSE(verified(shorter, cl, machine, 0.01)->passed());
}

// CAM systems write the same rapid point twice, and drilling cycles go up and down one line.
TEST(Verify, RepeatedRapidPointsAndDrilledHolesAreFollowed) {
  const std::string cl =
      "FEDRAT/600,MMPM\nRAPID\nGOTO/0,0,50,0.6,0,0.8\nRAPID\nGOTO/10,0,50\nRAPID\nGOTO/"
      "10,0,50.000001\nRAPID\n"
      "GOTO/10,0,5\nGOTO/10,0,0\nGOTO/20,0,0\nRAPID\nGOTO/20,0,0\nRAPID\nGOTO/20,0,50\n"
      "CYCLE/DEEP,FEDTO,9.,STEP,4.,MMPM,300,RAPTO,3.,RTRCTO,10.\nGOTO/10,0,0\nGOTO/20,0,0\nCYCLE/OFF\nRAPID\n"
      "GOTO/20,0,50\n";
  const auto out = posted(cl, test::shipped_machine("trunnion_offset"));
  ASSERT_TRUE(out.report) << out.report.error().text();
  ASSERT_TRUE(out.report->verification);
  EXPECT_TRUE(out.report->verification->passed());
  EXPECT_EQ(out.report->verification->points_missed, 0U);
}

TEST(Post, BareGotosPostWithAWarningForFeedAndSpindle) {
  const std::string cl = "GOTO/10,0,5,0.6,0,0.8\nGOTO/11,0,5,0.61,0,0.7924\nGOTO/12,0,5,0.62,0,0.7846\n";
  const Posted p = posted(cl, test::shipped_machine("paper"));
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
  std::vector<std::string> said;
  for (const Finding& finding : p.diagnostics.findings()) said.push_back(finding.text());
  EXPECT_THAT(said,
              testing::UnorderedElementsAre(
                  "part.cls:1:1: warning: no FEDRAT before this motion: the default feed of 250.0 mm/min is "
                  "used",
                  "part.cls:1:1: warning: no SPINDL before this cut: the spindle does not turn",
                  "part.cls: note: nothing in the file says its unit of length: taken as mm (--cl-units mm "
                  "or inch)"));
}

TEST(Post, PapersSecondAxisVectorPostsWithOneWarning) {
  // Section 3.2.3 of the paper: |U1| = 1.0020.
  const std::string cl =
      "SPINDL/6000,RPM,CLW\nFEDRAT/1000,MMPM\nGOTO/-191.4037,11.3508,7.6182,0.00639,-0.036377,0.99927\n"
      "GOTO/-191.4057,13.5159,7.9093,0.006393,-0.068922,0.99960\n";
  const Posted p = posted(cl, test::shipped_machine("paper"));
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(p.diagnostics.findings().size(), 1u);
  EXPECT_TRUE(p.report->verification->passed());
}

TEST(Post, LimitsNameTheAxisTheLineAndTheAmount) {
  const Posted p = posted("FEDRAT/100,MMPM\nGOTO/0,0,0\nGOTO/600,0,0\n", test::shipped_machine("paper"));
  ASSERT_FALSE(p.report);
  EXPECT_EQ(p.report.error().code, ErrorCode::check_failed);
  EXPECT_EQ(p.report.error().text(),
            "part.cls:3:1: error: axis X would have to go to 600.0000 mm, 100.0000 mm beyond its limits of "
            "-500.0000 mm to 500.0000 mm");
}

TEST(Post, CThatMustTurnBackLeavesThePartAlongTheToolAxis) {
  Machine machine = test::shipped_machine("paper");
  machine.axes[4].cyclic = false;
  machine.axes[4].min = -200.0 * kRadPerDegree;
  machine.axes[4].max = 200.0 * kRadPerDegree;
  machine.axes[3].min = 0.0;
  std::string cl = "FEDRAT/MMPM,1000\nRAPID\n";
  for (int i = 0; i <= 180; ++i) {
    const double turn = i * 3.0 * kRadPerDegree;
    cl += "GOTO/" + fixed_text(30 * std::cos(turn), 4) + "," + fixed_text(30 * std::sin(turn), 4) + ",0," +
          fixed_text(std::sin(0.5) * std::cos(turn), 7) + "," +
          fixed_text(std::sin(0.5) * std::sin(turn), 7) + "," + fixed_text(std::cos(0.5), 7) + "\n";
  }
  const Posted p = posted(cl, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(p.report->choice.reconfigurations, 1u);
  EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->certified_tip_deviation_mm;
  EXPECT_TRUE(p.report->verification->limits_ok());
}

// Into the pole along +X, out of it along +Y: C must turn by 90 deg while the tool stands along it.
std::string through_the_pole(int points_at_pole) {
  std::string cl = "FEDRAT/MMPM,1000\nRAPID\n";
  const auto point = [&](double x, double y, double i, double j) {
    cl += "GOTO/" + fixed_text(x, 4) + "," + fixed_text(y, 4) + ",0," + fixed_text(i, 7) + "," +
          fixed_text(j, 7) + "," + fixed_text(std::sqrt(1.0 - i * i - j * j), 7) + "\n";
  };
  for (int k = 20; k > 0; --k) point(30 + k, 40, 0.01 * k, 0);
  for (int k = 0; k < points_at_pole; ++k) point(30, 40 + k, 0, 0);
  for (int k = 1; k <= 20; ++k) point(30, 39 + points_at_pole + k, 0, 0.01 * k);
  return cl;
}

TEST(Post, PoleIsPassedWithinTolerance) {
  for (const char* name : {"paper", "trunnion_offset", "xyzac_trt"}) {
    for (const int points : {1, 2, 10}) {
      const Posted p = posted(through_the_pole(points), test::shipped_machine(name));
      ASSERT_TRUE(p.report) << p.report.error().text();
      const VerifyReport& v = *p.report->verification;
      EXPECT_TRUE(v.passed()) << name << " " << points << ": " << v.certified_tip_deviation_mm << " mm "
                              << v.max_axis_deviation.deg() << " deg";
      EXPECT_EQ(p.report->choice.turns_in_place, points == 1 ? 1u : 0u);
      EXPECT_LT(p.report->points_inserted, 100u);
    }
  }
}

TEST(Post, ToolCentrePointControlNeedsFewPointsAndKeepsTheAxis) {
  for (const char* control : {"fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640", "haas_ngc", "linuxcnc"}) {
    PostOptions options;
    options.rtcp = true;
    options.feed = FeedOutput::tip;
    options.axis_tolerance = Angle::degrees(0.01);
    const Posted p = posted(sample_path(3), test::shipped_machine("trunnion_offset"), options, control);
    ASSERT_TRUE(p.report) << control << " " << p.report.error().text();
    const VerifyReport& v = *p.report->verification;
    EXPECT_TRUE(v.passed()) << control;
    EXPECT_LT(v.certified_tip_deviation_mm, 0.00087) << control;  // half a micrometre in each of three words
    EXPECT_GT(p.report->points_inserted, 0u);
  }
}

TEST(Post, CompensatedProgramMeetsItsToleranceOnTheMachineWithErrors) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  Diagnostics d;
  const auto model = parse_model(
      "[model]\nname = \"m\"\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 60.0\nY0C_um = "
      "-45.0\nA0C_urad = 80.0\n"
      "B0C_urad = -50.0\n[[effect]]\nid = \"squareness:C0Y\"\n[effect.parameters]\nC0Y_urad = "
      "90.0\n[[effect]]\nid = \"backlash:X\"\n"
      "[effect.parameters]\nb_um = 5.0\n",
      "m.toml", machine, {}, d);
  ASSERT_TRUE(model) << model.error().text();
  PostOptions options;
  options.tolerance_mm = 0.003;
  const Posted p = posted(sample_path(3), machine, options, "linuxcnc", &*model);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->certified_tip_deviation_mm;
  EXPECT_TRUE(p.report->verification->on_truth);
  EXPECT_GT(p.report->largest_error_mm, 0.03);
  ASSERT_TRUE(p.report->nominal_verification);
  EXPECT_GT(p.report->nominal_verification->certified_tip_deviation_mm,
            0.03);  // on a perfect machine it would be wrong
}

TEST(Post, RepeatedPointsAndDrillingCyclesAreVerified) {
  const std::string cl =
      "FEDRAT/MMPM,500\nRAPID\nGOTO/0,0,30,0,0,1\nRAPID\nGOTO/0,0,30,0,0,1\nGOTO/0,0,10\nGOTO/"
      "0,0,10\nRAPID\nGOTO/0,0,10\n"
      "GOTO/0,0,5\nRAPID\nGOTO/0,0,30\nCYCLE/DRILL,FEDTO,2.75,MMPM,731.52,RAPTO,3.,RTRCTO,10.,DWELL,0\nGOTO/"
      "15.7,10.,-6.1,0,0,1\n"
      "GOTO/15.7,30.,-6.1,0,0,1\nCYCLE/OFF\nRAPID\nGOTO/0,0,50\n";
  const Posted p = posted(cl, test::shipped_machine("paper"));
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->points_missed << " "
                                                << p.report->verification->certified_tip_deviation_mm << p.nc;
}

TEST(Post, ThermalOffsetsAreTakenOutAlongTheProgram) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  Diagnostics d;
  const auto table = thermal::parse_offsets(
      "time_s,dx_um,dy_um,dz_um\n0,20,-10,5\n20,28,-16,-12\n1000,28,-16,-12\n", "o.csv", d);
  ASSERT_TRUE(table) << table.error().text();
  const nc::Controller c = test::shipped_controller("linuxcnc");
  PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &c;
  job.offsets = &*table;
  std::string nc;
  PostOptions options;
  options.tolerance_mm = 0.003;
  const auto report = post(
      std::make_unique<Text>(sample_path(3)), job, options,
      [&](std::string_view text) {
        nc += text;
        return Result<void>{};
      },
      d);
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_TRUE(report->verification->passed()) << report->verification->certified_tip_deviation_mm;
  EXPECT_NEAR(report->verification->duration_s, report->duration_s, 0.02 * report->duration_s);
  // On a machine without the drift the program is off by the drift.
  EXPECT_GT(report->nominal_verification->certified_tip_deviation_mm, 0.02);
}

TEST(Post, NothingButMotionsIsAnError) {
  EXPECT_EQ(posted("PARTNO X\nFINI\n", test::shipped_machine("paper")).report.error().text(),
            "part.cls:2: error: no motion (GOTO) in the file");
  EXPECT_EQ(posted("", test::shipped_machine("paper")).report.error().code, ErrorCode::wrong_input);
}

// Per minute and inverse time say the same duration: read back, F gives the programmed speed of the tip.
TEST(Post, FeedMakesTheTipMoveAtTheProgrammedSpeed) {
  Machine machine = test::shipped_machine("trunnion_offset");
  for (auto& axis : machine.axes) axis.rapid = 1e6;  // no axis limits the feed
  for (const FeedOutput output : {FeedOutput::inverse, FeedOutput::per_minute}) {
    PostOptions options;
    options.feed = output;
    const std::string cl = sample_path(2);
    const Posted p = posted(cl, machine, options);
    ASSERT_TRUE(p.report);
    // Length of the cut, from the CL text alone.
    double length = 0.0;
    Vec3 before;
    Diagnostics d;
    const auto program = cl::read_program(cl, "part.cls", {}, d);
    bool first = true;
    double rapid_s = 0.0;
    for (const auto& record : program->records) {
      const auto* m = std::get_if<cl::Motion>(&record.data);
      if (m == nullptr) continue;
      if (!first && !m->rapid) length += (m->tip_P - before).norm();
      before = m->tip_P;
      first = false;
    }
    rapid_s = p.report->duration_s - length / 20.0;
    EXPECT_LT(std::abs(rapid_s), 0.002 * p.report->duration_s);
    EXPECT_LT(p.report->feed_time_lost_s, 1e-6);
  }
}

// Faults of the file, with their place, and not numbers that no control holds.
TEST(Post, SpeedsAndDwellsThatNoMachineHasAreErrorsWithTheirLine) {
  const Machine machine = test::shipped_machine("paper");
  const auto error_of = [&](const std::string& line) {
    const Posted p = posted("GOTO/0,0,5\n" + line + "\nGOTO/1,1,1\n", machine);
    return p.report ? "none" : p.report.error().text();
  };
  EXPECT_EQ(error_of("SPINDL/RPM,1e300,CLW"),
            "part.cls:2:1: error: SPINDL: 1e+300 rpm is not between 1 and 1e+06 rpm");
  EXPECT_EQ(error_of("SPINDL/RPM,0.1,CLW"),
            "part.cls:2:1: error: SPINDL: 0.1 rpm is not between 1 and 1e+06 rpm");
  EXPECT_EQ(error_of("SPINDL/RPM,100000,CLW"), "none");
  EXPECT_EQ(error_of("DELAY/1e300"), "part.cls:2:1: error: DELAY: 1e+300 s is more than a day");
  EXPECT_EQ(error_of("DELAY/3600"), "none");
}

// Behind the last CL point: a block that ends there and leaves it on its way. C turns by half a turn with the
// tool upright, X and Y go straight: half way the tip is at the other side of the axis of C.
TEST(Verify, ABlockBehindTheLastPointIsJudgedWhole) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = "UNITS/MM\nLOADTL/1\nFEDRAT/250.,MMPM\n" +
                         test::point_text({20.0, 0.0, 5.0}, Vec3::UnitZ()) +
                         test::point_text({30.0, 0.0, 5.0}, Vec3::UnitZ()) + "FINI\n";
  const auto p = test::posted(cl, machine, {});
  ASSERT_TRUE(p.report) << p.report.error().text();
  const TableKinematics kinematics(machine, machine.tool_vector());
  JointVector q;
  q[*machine.axis("C")] = kPi;
  kinematics.solve_linear({30.0, 0.0, 5.0}, kinematics.sines(q), q);
  const JointVector words = words_of(machine, q, machine.tool_vector());
  const std::string turn = "G1 X" + fixed_text(words[*machine.axis("X")], 4) + " Y" +
                           fixed_text(words[*machine.axis("Y")], 4) + " C180. F250.\n";
  std::string nc = p.nc;
  const auto end = nc.find("G53", nc.rfind("G1 "));
  ASSERT_NE(end, std::string::npos);
  nc.insert(end, turn);
  const auto v = test::verified(nc, cl, machine, 0.01);
  ASSERT_TRUE(v) << v.error().text();
  EXPECT_FALSE(v->cuts_within_tolerance());
  EXPECT_GT(v->certified_tip_deviation_mm, 29.0);
}

}  // namespace
}  // namespace trunnion::post
