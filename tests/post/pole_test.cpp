// The pole's cone: what is tilted, by how much, and that the tip stays.
#include "trunnion/path/pole.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "post/posting.hpp"
#include "support/cases.hpp"

namespace trunnion::post {
namespace {

using test::posted;

// A cut that passes the pole at a distance of `nearest_deg`, with points that see it.
std::string past_the_pole(double nearest_deg, const std::string& before = "") {
  std::string cl = "FEDRAT/MMPM,1000\nRAPID\n" + before;
  for (int k = -30; k <= 30; ++k) {
    const double i = 0.003 * k;
    const double j = std::sin(nearest_deg * kRadPerDegree);
    cl += "GOTO/" + fixed_text(30.0 + 0.4 * k, 4) + ",40,0," + fixed_text(i, 9) + "," + fixed_text(j, 9) +
          "," + fixed_text(std::sqrt(1.0 - i * i - j * j), 9) + "\n";
  }
  return cl;
}

double largest_c_step(const Machine& machine, const VerifyReport& report) {
  const AxisId c = *machine.axis("C");
  double largest = 0.0;
  double turned = 0.0;
  for (std::size_t i = 1; i < report.blocks.size(); ++i) {
    if (report.blocks[i].rapid) continue;
    turned += std::abs(report.blocks[i].q[c] - report.blocks[i - 1].q[c]);
    if (!report.blocks[i].programmed) continue;
    largest = std::max(largest, turned);
    turned = 0.0;
  }
  return largest * kDegreePerRad;
}

TEST(Pole, ToolAxisIsTiltedWithinTheToleranceAndTheTipStays) {
  for (const char* name : {"trunnion_offset", "paper", "nutating_45"}) {
    const Machine machine = test::shipped_machine(name);
    const std::string cl = past_the_pole(0.2);
    PostOptions plain;
    plain.collect = true;
    const auto before = posted(cl, machine, plain);
    ASSERT_TRUE(before.report) << name << before.report.error().text();
    PostOptions options = plain;
    options.pole.tolerance = Angle::degrees(0.25);
    const auto p = posted(cl, machine, options);
    ASSERT_TRUE(p.report) << name << " " << p.report.error().text();
    const VerifyReport& v = *p.report->verification;
    EXPECT_TRUE(v.passed()) << name << " tip " << v.certified_tip_deviation_mm << " axis "
                            << v.max_axis_deviation.deg() << " pole " << v.max_pole_axis_deviation.deg();
    EXPECT_EQ(p.report->pole_stretches, 1U) << name;
    EXPECT_LE(p.report->largest_pole_tilt.deg(), 0.25) << name;
    EXPECT_GT(p.report->largest_pole_tilt.deg(), 0.1) << name;
    EXPECT_LT(largest_c_step(machine, v), 3.0) << name;
    EXPECT_GT(largest_c_step(machine, *before.report->verification), 20.0) << name;
    EXPECT_LE(v.max_point_deviation_mm, 1e-3) << name;
    bool reported = false;
    for (const auto& finding : p.diagnostics.findings())
      reported = reported || finding.text().find("tilted by up to") != std::string::npos;
    EXPECT_TRUE(reported) << name;
  }
}

// A cut whose tool axis wanders about the pole, in and out of the tolerance, and may end anywhere there.
std::string about_the_pole(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double i0 = 0.02 * (u(random) - 0.5);
  const double j0 = 0.02 * (u(random) - 0.5);
  const double size = 0.02 * u(random);
  const double turns = 0.1 + 0.3 * u(random);
  const double start = kTwoPi * u(random);
  std::string cl = "FEDRAT/MMPM,1000\nRAPID\n";
  const int points = 10 + static_cast<int>(30.0 * u(random));
  for (int k = 0; k < points; ++k) {
    const double turn = start + turns * k;
    const double i = i0 + size * std::cos(turn);
    const double j = j0 + size * std::sin(0.7 * turn);
    cl += test::point_text({20.0 * std::cos(0.1 * k), 20.0 * std::sin(0.1 * k), 0.2 * k},
                           {i, j, std::sqrt(1.0 - i * i - j * j)});
  }
  return cl;
}

// C may leave its place by more than a quarter turn where the choice put it to the side of its window.
TEST(LongPole, NoToolAxisIsTiltedByMoreWhereverTheCutGoes) {
  std::mt19937_64 random(95);
  std::size_t programs = 0;
  std::size_t tilted = 0;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    for (int i = 0; i < test::cases(150, "TRUNNION_CASES"); ++i) {
      const std::string cl = about_the_pole(random);
      PostOptions options;
      options.pole.tolerance = Angle::degrees(0.5);
      const auto p = posted(cl, machine, options);
      if (!p.report) continue;  // an axis' travel, by name: EveryMachine.* look at that
      ++programs;
      tilted += p.report->pole_stretches;
      EXPECT_LE(p.report->largest_pole_tilt.deg(), 0.5) << name << "\n" << cl;
      EXPECT_EQ(p.report->verification->points_missed, 0U) << name << "\n" << cl;
      EXPECT_TRUE(p.report->verification->passed()) << name << "\n" << cl;
    }
  }
  EXPECT_GT(2 * tilted, programs);
}

// The axis in the program is off by more than the axis tolerance: without the stated tolerance of the pole
// the verification does not let it pass.
TEST(Pole, VerificationWithoutThePolesToleranceFails) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = past_the_pole(0.2);
  PostOptions options;
  options.pole.tolerance = Angle::degrees(0.25);
  const auto p = posted(cl, machine, options);
  ASSERT_TRUE(p.report);
  EXPECT_FALSE(test::verified(p.nc, cl, machine, 0.01)->passed());
}

TEST(Pole, OutsideTheConeAndBelowTheLeastTurnNothingChanges) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  PostOptions options;
  const auto plain = posted(past_the_pole(0.2), machine, options).nc;
  options.pole.tolerance = Angle::degrees(0.25);
  options.pole.cone = Angle::degrees(0.1);
  EXPECT_EQ(posted(past_the_pole(0.2), machine, options).nc, plain);
  options.pole.cone = Angle::degrees(5.0);
  options.pole.min_turn = Angle::degrees(170.0);
  EXPECT_EQ(posted(past_the_pole(0.2), machine, options).nc, plain);
}

// With a tolerance that does not reach the pole C still has to turn: points are inserted, and it is said.
TEST(Pole, WhereTheToleranceDoesNotReachPointsAreInsertedAndItIsReported) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.axes[3].min = 0.0;  // A cannot pass to the other side
  PostOptions options;
  options.pole.tolerance = Angle::degrees(0.01);
  const auto p = posted(past_the_pole(0.2), machine, options);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_GT(p.report->points_inserted, 0U);
  EXPECT_GT(p.report->pole_turns_cutting, 0U);
}

// A rapid leads to a point on the pole, and the cut leaves it sideways: C turns at the rapid.
TEST(Pole, CTurnsEarlyAtARapid) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::string cl =
      "FEDRAT/MMPM,1000\nRAPID\nGOTO/40,10,20,0.5,0,0.866025404\nGOTO/40,10,0,0.5,0,0.866025404\n";
  cl += "RAPID\nGOTO/30,40,30,0,0,1\nGOTO/30,40,0,0,0,1\n";
  for (int k = 1; k <= 20; ++k) {
    const double j = 0.01 * k;
    cl += "GOTO/30," + fixed_text(40.0 + k, 4) + ",0,0," + fixed_text(j, 9) + "," +
          fixed_text(std::sqrt(1.0 - j * j), 9) + "\n";
  }
  const auto p = posted(cl, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_EQ(p.report->pole_turns_early, 1U);
  EXPECT_EQ(p.report->pole_turns_cutting, 0U);
}

}  // namespace
}  // namespace trunnion::post
