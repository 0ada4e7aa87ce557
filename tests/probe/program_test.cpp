#include "trunnion/probe/program.hpp"

#include <gtest/gtest.h>

#include "trunnion/probe/planned.hpp"
#include "trunnion/probe/strokes.hpp"

#include "probe/given.hpp"
#include "probe/hidden_machine.hpp"

namespace trunnion::probe {
namespace {

using test::Given;

TEST(ProbeProgram, IsReadBackWithoutAFault) {
  for (const char* name : {"trunnion_offset", "paper", "xyzac_trt", "nutating_45"}) {
    const Given given(name);
    const auto program = make_program(given.machine, given.control, given.options());
    ASSERT_TRUE(program) << name << ": " << program.error().text();
    Diagnostics diagnostics;
    const auto strokes = read_strokes(given.machine, given.control, program->text, "p.nc", diagnostics);
    ASSERT_TRUE(strokes) << name << ": " << strokes.error().text();
    EXPECT_EQ(strokes->poses.size(), 12U) << name;
    EXPECT_EQ(strokes->touches.size(), 121U) << name;
    EXPECT_EQ(program->touches, strokes->log_lines());
    EXPECT_THAT(faults_of(given.machine, *strokes), testing::IsEmpty()) << name;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(strokes->ball.place_P[static_cast<Eigen::Index>(i)],
                  given.options().ball.place_P[static_cast<Eigen::Index>(i)], 1e-9);
  }
}

// On a machine whose axes are elsewhere the ball is met by touches only, and by all of them.
TEST(ProbeProgram, TouchesABallThatLiesElsewhereAndNeverRunsIntoIt) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> off(-1.0, 1.0);
  const Given given("trunnion_offset");
  for (int i = 0; i < 200; ++i) {
    ProgramOptions options = given.options();
    options.ball.within_mm = 5.0;
    options.ball.place_P += Vec3(20.0 * off(random), 20.0 * off(random), 10.0 * off(random));
    const auto program = make_program(given.machine, given.control, options);
    ASSERT_TRUE(program) << program.error().text();
    auto hidden = given.hidden(options.ball);
    // As far off as is promised, in any direction.
    for (double& v : hidden.a_point) v += 0.6 * off(random);
    for (double& v : hidden.c_point) v += 0.6 * off(random);
    for (double& v : hidden.ball) v += 0.6 * off(random);
    hidden.a_direction = test::turned(hidden.a_direction, {0, 0, 1}, 0.3 * off(random));
    hidden.c_direction = test::turned(hidden.c_direction, {1, 0, 0}, 0.3 * off(random));
    hidden.noise_mm = 0.001;
    const auto run = test::run_probing(program->text, hidden, 1);
    EXPECT_EQ(run.touches, program->touches);
    EXPECT_GT(run.nearest_mm, 1.0) << i;
  }
}

TEST(ProbeProgram, SaysWhatIsWrongWithAnEditedText) {
  const Given given("trunnion_offset");
  const auto program = make_program(given.machine, given.control, given.options());
  ASSERT_TRUE(program);
  const auto faults = [&](const std::string& from, const std::string& to) {
    std::string text = program->text;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    Diagnostics diagnostics;
    const auto strokes = read_strokes(given.machine, given.control, text, "p.nc", diagnostics);
    if (!strokes) return std::string(strokes.error().message);
    const auto found = faults_of(given.machine, *strokes);
    return found.empty() ? std::string() : found.front();
  };
  EXPECT_THAT(faults("X82.4100\nZ34.7100\n", "X72.4100\nZ34.7100\n"),
              testing::HasSubstr("the centres of stylus and ball"));
  EXPECT_THAT(faults("G1 X82.4100 Y40.0000 Z34.7100", "G1 X82.4100 Y40.0000 Z52.4100"),
              testing::HasSubstr("does not go back"));
  EXPECT_THAT(faults("G53 G0 Z700.0000\nG0 A-29.99", "G0 A-29.99"),
              testing::HasSubstr("below the safe height"));
  EXPECT_THAT(faults("G38.2 X68.5437 Y40.0000 Z34.7100", "G38.2 X68.5437 Y70.0000 Z34.7100"),
              testing::HasSubstr("passes the ball"));
  EXPECT_THAT(faults("X60.0000 Y40.0000\nZ549", "X600.0000 Y40.0000\nZ549"),
              testing::HasSubstr("beyond its limit"));
  EXPECT_THAT(faults("(ball radius: 12.7000)\n", ""), testing::HasSubstr("no line 'ball radius:'"));
}

TEST(ProbeProgram, RefusesWhatCannotBeReached) {
  Given given("trunnion_offset");
  auto options = given.options();
  options.ball.place_P.x() = 900.0;
  const auto far = make_program(given.machine, given.control, options);
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().code, ErrorCode::check_failed);
  given.machine.safe.table = TableExtent{100.0, 70.0};
  const auto below = make_program(given.machine, given.control, given.options());
  ASSERT_FALSE(below);
  EXPECT_THAT(below.error().message, testing::HasSubstr("below the table's top"));
}

// A plan's run as the ball and the poses of a program; what cannot be reached is left out.
TEST(PlannedBall, IsTouchedAtThePosesOfThePlan) {
  const Given given("trunnion_offset");
  Diagnostics diagnostics;
  const auto plan = diagnosis::parse_plan(R"([[run]]
id = "ball"
quantity = "displacement"
n = [[1, 0, 0], [0, 0, 1]]
tool_z_mm = -150
u_random = 1
both_directions = true
ball_mm = [60, 40, 30]
[run.grid]
A_deg = [-30, 0, 45, 120]
C_deg = [0, 90, 180]
[[run]]
id = "laser"
quantity = "displacement"
n = [[1, 0, 0]]
tool_z_mm = -150
u_random = 1
[run.sweep]
axis = "X"
from_mm = -100
to_mm = 100
points = 5
)",
                                          "plan.toml", given.machine, diagnostics);
  ASSERT_TRUE(plan) << plan.error().text();
  const auto ball = planned_ball(plan->runs[0], given.machine, "plan.toml");
  ASSERT_TRUE(ball) << ball.error().text();
  EXPECT_NEAR((ball->place_P - Vec3(60, 40, 30)).norm(), 0.0, 1e-9);
  EXPECT_EQ(ball->poses.size(), 12U);
  EXPECT_TRUE(ball->both_directions);
  EXPECT_NEAR(ball->stylus_length_mm, 150.0, 1e-12);
  ProgramOptions options = given.options();
  options.planned = ball->poses;
  const auto program = make_program(given.machine, given.control, options);
  ASSERT_TRUE(program) << program.error().text();
  // The table leans by more than 60 deg at A120, and A-30 stays a little within the travel.
  EXPECT_EQ(program->chosen.poses.size(), 9U);
  EXPECT_NE(program->text.find("A-29.99"), std::string::npos);
  EXPECT_EQ(program->text.find("A-30"), std::string::npos);
  const auto laser = planned_ball(plan->runs[1], given.machine, "plan.toml");
  ASSERT_FALSE(laser);
  EXPECT_NE(laser.error().message.find("'laser' is no ball"), std::string::npos);
}

}  // namespace
}  // namespace trunnion::probe
