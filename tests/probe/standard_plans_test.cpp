// Plans of the standards' tests, held against the machine's chain as it stands in its file, worked out apart.
#include "trunnion/diagnosis/standard_plans.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/machine/kinematics.hpp"
#include "trunnion/probe/planned.hpp"

#include "probe/given.hpp"

namespace trunnion::probe {
namespace {

using diagnosis::standard_plan;
using test::Given;

diagnosis::StandardSetUp two_balls() {
  diagnosis::StandardSetUp out;
  out.balls_P = {{60.0, 40.0, 30.0}, {-30.0, 50.0, 90.0}};
  return out;
}

// The part's turn of trunnion_offset by hand: A about -X through (0, 0.4, -65), C about -Z through (0.1, 0).
Eigen::Isometry3d part_at(double a, double c) {
  using Eigen::AngleAxisd;
  using Eigen::Translation3d;
  const Translation3d on_a(0.0, 0.4, -65.0);
  const Translation3d on_c(0.1, 0.0, -30.0);
  return on_a * AngleAxisd(-a, Vec3::UnitX()) * on_a.inverse() *
         (on_c * AngleAxisd(-c, Vec3::UnitZ()) * on_c.inverse());
}

TEST(StandardPlan, FollowsTheBallWithOneRotaryAxisAndTheLinearOnes) {
  const Given given("trunnion_offset");
  for (const char* kind : {"rtest", "bk1", "bk2"}) {
    const auto set_up = two_balls();
    const auto runs = standard_plan(given.machine, kind, set_up);
    ASSERT_TRUE(runs) << runs.error().text();
    ASSERT_EQ(runs->size(), kind == std::string("rtest") ? 4U : 2U);
    for (std::size_t k = 0; k < runs->size(); ++k) {
      const auto data = diagnosis::expand({(*runs)[k]}, given.machine);
      ASSERT_TRUE(data) << data.error().text();
      const Vec3& ball = set_up.balls_P[kind == std::string("rtest") ? k / 2 : k];
      double turned = 0.0;
      for (std::size_t row = 0; row < data->rows.size(); ++row) {
        const JointVector& q = data->track.state(row).q;
        const Vec3 tip(q[0], q[1], q[2] - given.machine.tool_length_mm);
        EXPECT_NEAR((part_at(q[3], q[4]) * ball - tip).norm(), 0.0, 1e-9);
        EXPECT_TRUE(limit_violations(given.machine, q).empty());
        if (kind == std::string("bk1")) {
          EXPECT_EQ(q[4], 0.0);
        }
        if (kind == std::string("bk2")) {
          EXPECT_EQ(q[3], 0.0);
        }
        turned = std::max(turned, std::abs(q[3]) + std::abs(q[4]));
      }
      EXPECT_GT(turned, 60.0 * kRadPerDegree);
      const auto& n = (*runs)[k].n;
      ASSERT_EQ(n.size(), 3U);
      if (kind == std::string("rtest")) continue;
      EXPECT_GT((*runs)[k].feed_mm_s, 0.0);
      // Axial, radial, tangential: square to each other; the arm has nothing tangential.
      const Vec3 on = kind == std::string("bk1") ? Vec3(0.0, 0.4, -65.0) : Vec3(0.1, 0.0, -30.0);
      EXPECT_NEAR(std::abs(n[0].dot(n[1])) + std::abs(n[1].dot(n[2])), 0.0, 1e-12);
      EXPECT_NEAR(n[2].dot(ball - on), 0.0, 1e-9);
      EXPECT_GT(n[1].dot(ball - on), 1.0);
    }
  }
}

TEST(StandardPlan, LeadsTheTipRoundAConeWithTheToolAlongIt) {
  const Given given("trunnion_offset");
  diagnosis::StandardSetUp set_up;
  set_up.balls_P = {{5.0, -8.0, 40.0}};
  for (const double inclination : {0.0, 10.0, 30.0}) {
    set_up.cone.inclination = Angle::degrees(inclination);
    const auto runs = standard_plan(given.machine, "frustum", set_up);
    ASSERT_TRUE(runs) << runs.error().text();
    const auto data = diagnosis::expand(*runs, given.machine);
    ASSERT_TRUE(data);
    Vec3 normal = Vec3::Zero();
    std::vector<Vec3> tips, axes;
    for (std::size_t row = 0; row < data->rows.size(); ++row) {
      const JointVector& q = data->track.state(row).q;
      const Eigen::Isometry3d back = part_at(q[3], q[4]).inverse();
      tips.push_back(back * Vec3(q[0], q[1], q[2] - given.machine.tool_length_mm) - set_up.balls_P[0]);
      axes.push_back(back.linear() * Vec3::UnitZ());
      normal += axes.back();
      EXPECT_NEAR(tips.back().norm(), 40.0, 1e-8);
    }
    // The cone's axis stands by the inclination off the table's normal, square to the circle.
    normal = tips[0].cross(tips[18]).normalized();
    EXPECT_NEAR(std::acos(std::min(1.0, normal.z())) * kDegreePerRad, inclination, 1e-6);
    for (std::size_t row = 0; row < tips.size(); ++row) {
      EXPECT_NEAR(tips[row].dot(normal), 0.0, 1e-8);
      EXPECT_NEAR(std::acos(axes[row].dot(normal)) * kDegreePerRad, 15.0, 1e-6);
      EXPECT_LT(axes[row].dot(tips[row]), 0.0);  // towards the cone's axis
    }
  }
}

// A cut of 40 mm with a turn at its end, and one of 10 mm elsewhere: readings at equal ways, the turn counted
// 50 mm up the tool, none on the way between; tip and axis by the chain above.
TEST(StandardPlan, FollowsTheCutsOfAPathAtEqualWays) {
  const Given given("trunnion_offset");
  diagnosis::StandardSetUp set_up;
  const auto tilted = [](double by) { return Vec3(0.0, -std::sin(by), std::cos(by)); };
  set_up.cuts = {{{{0, 0, 30}, Vec3::UnitZ()}, {{40, 0, 30}, Vec3::UnitZ()}, {{40, 0, 30}, tilted(0.3)}},
                 {{{0, 50, 40}, Vec3::UnitZ()}, {{0, 60, 40}, Vec3::UnitZ()}}};
  set_up.poses = 27;  // 40 mm, 15 mm of turning, 10 mm: 2.5 mm each
  const auto runs = standard_plan(given.machine, "path", set_up);
  ASSERT_TRUE(runs) << runs.error().text();
  ASSERT_EQ(runs->size(), 1U);
  const auto& poses = std::get<diagnosis::PlanPoses>((*runs)[0].path).poses;
  ASSERT_EQ(poses.size(), 27U);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const JointVector& q = poses[i];
    const Eigen::Isometry3d back = part_at(q[3], q[4]).inverse();
    const Vec3 tip = back * Vec3(q[0], q[1], q[2] - given.machine.tool_length_mm);
    const double way = 2.5 * static_cast<double>(i);
    const Vec3 there = way <= 55.0 ? Vec3(std::min(40.0, way), 0.0, 30.0) : Vec3(0.0, way - 5.0, 40.0);
    const double turn = way <= 40.0 || way > 55.0 ? 0.0 : (way - 40.0) / 50.0;
    EXPECT_NEAR((tip - there).norm(), 0.0, 1e-8) << i;
    EXPECT_NEAR((back.linear() * Vec3::UnitZ() - tilted(turn)).norm(), 0.0, 1e-9) << i;
  }
  set_up.cuts.back().pop_back();
  EXPECT_FALSE(standard_plan(given.machine, "path", set_up));
  set_up.cuts.clear();
  EXPECT_FALSE(standard_plan(given.machine, "path", set_up));
}

TEST(StandardPlan, IsMadeForEveryShippedMachineAndTouchedByAProbe) {
  for (const char* name : {"trunnion_offset", "paper", "xyzac_trt", "nutating_45"}) {
    const Given given(name);
    const auto runs = standard_plan(given.machine, "rtest", two_balls());
    ASSERT_TRUE(runs) << name << ": " << runs.error().text();
    for (const auto& run : *runs) {
      const auto ball = planned_ball(run, given.machine, "plan.toml");
      ASSERT_TRUE(ball) << name << ": " << ball.error().text();
      EXPECT_GE(ball->poses.size(), 4U);
    }
  }
}

TEST(StandardPlan, RefusesABallWithoutAnArm) {
  const Given given("trunnion_offset");
  diagnosis::StandardSetUp set_up;
  set_up.balls_P = {{0.1, 0.0, 30.0}};
  const auto runs = standard_plan(given.machine, "bk2", set_up);
  ASSERT_FALSE(runs);
  EXPECT_THAT(runs.error().message, testing::HasSubstr("lies on axis C"));
}

}  // namespace
}  // namespace trunnion::probe
