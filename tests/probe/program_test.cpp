#include "trunnion/probe/program.hpp"

#include <gtest/gtest.h>
#include <map>
#include <random>
#include <sstream>

#include "trunnion/probe/planned.hpp"
#include "trunnion/probe/reading.hpp"
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
TEST(LongProbeProgram, TouchesABallThatLiesElsewhereAndNeverRunsIntoIt) {
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

// The control adds the length of the probe, and the words would be those of the gauge point.
TEST(ProbeProgram, RefusesGaugePointWordsWhereTheControlAddsTheLength) {
  Given given("trunnion_offset", "heidenhain_tnc640");
  given.machine.output_point = OutputPoint::spindle;
  const auto program = make_program(given.machine, given.control, given.options());
  ASSERT_FALSE(program);
  EXPECT_EQ(program.error().code, ErrorCode::wrong_use);
  EXPECT_THAT(program.error().message, testing::HasSubstr("it needs point = \"tip\""));
  given.machine.output_point = OutputPoint::tip;
  const auto of_tip = make_program(given.machine, given.control, given.options());
  EXPECT_TRUE(of_tip || of_tip.error().code != ErrorCode::wrong_use) << of_tip.error().message;
}

// Each pose from below and from above: what a worn worm leaves of the table's angle is in the readings, with
// the sense that it belongs to.
TEST(ProbeProgram, ReachesEachPoseFromBothSenses) {
  const Given given("trunnion_offset");
  ProgramOptions options = given.options();
  options.poses = 6;
  options.both_senses = true;
  const auto program = make_program(given.machine, given.control, options);
  ASSERT_TRUE(program) << program.error().text();
  Diagnostics diagnostics;
  const auto strokes = read_strokes(given.machine, given.control, program->text, "p.nc", diagnostics);
  ASSERT_TRUE(strokes) << strokes.error().text();
  EXPECT_THAT(faults_of(given.machine, *strokes), testing::IsEmpty());
  ASSERT_EQ(strokes->poses.size(), 12U);
  EXPECT_EQ(strokes->touches.size(), program->touches);
  auto hidden = given.hidden(options.ball);
  hidden.c_backlash_deg = 0.02;
  hidden.noise_mm = 0.0002;
  const auto run = test::run_probing(program->text, hidden, 3);
  ASSERT_EQ(run.touches, program->touches);
  const auto reading = read_touches(given.machine, *strokes, run.log, "log.txt", {});
  ASSERT_TRUE(reading) << reading.error().text();
  const AxisId c = *given.machine.axis("C");
  const AxisId a = *given.machine.axis("A");
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t back = 11 - i;
    ASSERT_EQ(strokes->poses[i][c], strokes->poses[back][c]);
    const auto& up = reading->data.track.state(i);
    const auto& down = reading->data.track.state(back);
    EXPECT_EQ(up.direction[c], 1);
    EXPECT_EQ(down.direction[c], -1);
    EXPECT_EQ(up.direction[0], 0);
    // A cannot overrun at the end of its travel.
    if (strokes->poses[i][a] > -25.0 * kRadPerDegree) {
      EXPECT_EQ(up.direction[a], 1);
    }
    // The ball where it really is, by the chain written apart; the table turns the other way than C says.
    const double at_a = strokes->poses[i][a] * kDegreePerRad;
    const double at_c = strokes->poses[i][c] * kDegreePerRad;
    const auto low = hidden.ball_at(at_a, at_c - 0.01);
    const auto high = hidden.ball_at(at_a, at_c + 0.01);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const auto n = static_cast<std::size_t>(k);
      EXPECT_NEAR(reading->poses[i].sphere.center_mm[k] - reading->poses[back].sphere.center_mm[k],
                  low[n] - high[n], 0.001);
    }
  }
}

// An arm of any direction that holds the ball: nothing but the ball is touched, wherever within its
// uncertainty it is.
TEST(LongProbeProgram, KeepsTheStylusOffTheArmThatHoldsTheBall) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> off(-1.0, 1.0);
  const Given given("trunnion_offset");
  std::size_t made = 0;
  for (int i = 0; i < 40; ++i) {
    ProgramOptions options = given.options();
    options.ball.within_mm = 1.5;
    options.largest_tilt = Angle::degrees(90.0);
    const Vec3 way = Vec3(off(random), off(random), 0.3 * off(random) - 0.5).normalized();
    options.ball.stem = Stem{options.ball.place_P + 80.0 * way, 4.0};
    const auto program = make_program(given.machine, given.control, options);
    if (!program) {
      EXPECT_EQ(program.error().code, ErrorCode::check_failed);
      continue;
    }
    ++made;
    auto hidden = given.hidden(options.ball);
    const Vec3 end = options.ball.stem->end_P + given.machine.part_zero_mm;
    hidden.stem_end = {end.x(), end.y(), end.z()};
    hidden.stem_mm = 4.0;
    const Vec3 by = 1.5 * Vec3(off(random), off(random), off(random)).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      hidden.ball[k] += by[static_cast<Eigen::Index>(k)];
      hidden.stem_end[k] += by[static_cast<Eigen::Index>(k)];
    }
    const auto run = test::run_probing(program->text, hidden, 1);
    EXPECT_EQ(run.touches, program->touches);
    EXPECT_GT(run.stem_mm, 0.0) << i;
    Diagnostics diagnostics;
    const auto strokes = read_strokes(given.machine, given.control, program->text, "p.nc", diagnostics);
    ASSERT_TRUE(strokes);
    ASSERT_TRUE(strokes->ball.stem.has_value());
    EXPECT_NEAR((strokes->ball.stem->end_P - options.ball.stem->end_P).norm(), 0.0, 1e-3);
    EXPECT_THAT(faults_of(given.machine, *strokes), testing::IsEmpty());
  }
  EXPECT_GE(made, 30U);
}

// Where the machine has little room over the table the ball can stand in the way of the stylus while the axes
// turn, one after the other in any order.
TEST(ProbeProgram, TurnsOnlyWhereTheBallDoesNotMeetTheStylus) {
  std::size_t made = 0;
  std::size_t tight = 0;
  for (double safe = 170.0; safe <= 240.0; safe += 5.0) {
    Given given("trunnion_offset");
    given.machine.safe.to_mm[2] = safe;
    auto options = given.options();
    options.largest_tilt = Angle::degrees(30.0);
    options.poses = 6;
    const auto program = make_program(given.machine, given.control, options);
    if (!program) continue;
    Diagnostics diagnostics;
    const auto strokes = read_strokes(given.machine, given.control, program->text, "p.nc", diagnostics);
    ASSERT_TRUE(strokes);
    if (!faults_of(given.machine, *strokes).empty()) continue;
    ++made;
    tight += program->before_start.empty() ? 0U : 1U;
    // By a chain written apart, from the words.
    const auto hidden = given.hidden(options.ball);
    const double tip = safe - given.machine.tool_length_mm;
    std::map<char, double> at;
    std::istringstream lines(program->text);
    for (std::string line; std::getline(lines, line);) {
      if (line.empty() || line[0] == '(' || line[0] == 'T') continue;
      std::map<char, double> to = at;
      std::istringstream words(line);
      for (std::string word; words >> word;) {
        if (std::string("XYZAC").find(word[0]) != std::string::npos && line.find("G53") == std::string::npos)
          to[word[0]] = std::stod(word.substr(1));
      }
      if (at.count('X') != 0 && at.count('A') != 0 && (at['A'] != to['A'] || at['C'] != to['C'])) {
        for (int first = 0; first <= 40; ++first) {
          for (int second = 0; second <= 40; ++second) {
            const double a = at['A'] + (to['A'] - at['A']) * first / 40.0;
            const double c = at['C'] + (to['C'] - at['C']) * second / 40.0;
            const auto ball = hidden.ball_at(a, c);
            const double apart =
                std::hypot(std::hypot(ball[0] - at['X'], ball[1] - at['Y']), std::min(0.0, ball[2] - tip));
            ASSERT_GT(apart, hidden.reach_mm + options.ball.within_mm) << safe << ": " << line;
          }
        }
      }
      at = to;
    }
  }
  EXPECT_GT(made, 3U);
  EXPECT_GT(tight, 0U);
}

// The descent to a new pose: by rapid only where the ball cannot be, even with the sense of an axis wrong.
TEST(ProbeProgram, ComesDownByFeedWhereAnAxisOfTheWrongSenseWouldPutTheBall) {
  for (const char* name : {"trunnion_offset", "paper"}) {
    const Given given(name);
    const auto options = given.options();
    const auto program = make_program(given.machine, given.control, options);
    ASSERT_TRUE(program);
    double top = -1e9;
    for (double a = -120.0; a <= 120.0; a += 0.5) {
      for (double c = 0.0; c < 360.0; c += 3.0)
        top = std::max(top, given.hidden(options.ball).ball_at(a, c)[2]);
    }
    std::istringstream lines(program->text);
    std::string motion;
    std::size_t rapids = 0;
    for (std::string line; std::getline(lines, line);) {
      if (line.empty() || line[0] == '(' || line.find("G53") != std::string::npos) continue;
      if (line[0] == 'G') motion = line.substr(0, line.find(' '));
      const auto z = line.find('Z');
      if (motion != "G0" || z == std::string::npos) continue;
      EXPECT_GT(std::stod(line.substr(z + 1)), top + options.ball.reach_mm()) << name << ": " << line;
      ++rapids;
    }
    EXPECT_EQ(rapids, program->chosen.poses.size()) << name;
  }
}

TEST(LongProbeProgram, KeepsTheProbesBodyOffTheTable) {
  Given given("trunnion_offset");
  given.machine.safe.table = TableExtent{200.0, 5.0};
  auto options = given.options();
  options.largest_tilt = Angle::degrees(90.0);
  options.poses = 24;
  const auto steepest = [&](const ProgramOptions& asked) {
    const auto program = make_program(given.machine, given.control, asked);
    EXPECT_TRUE(program) << program.error().text();
    double most = 0.0;
    if (program) {
      for (const JointVector& q : program->chosen.poses)
        most = std::max(most, std::abs(q[*given.machine.axis("A")]) * kDegreePerRad);
    }
    return most;
  };
  const double alone = steepest(options);
  options.ball.body = ProbeBody{60.0, 50.0};
  const double with_body = steepest(options);
  EXPECT_GT(alone, 80.0);
  EXPECT_LT(with_body, alone - 10.0);
  // By hand: at A the table's edge, 200 mm from its axis, against a cylinder of 60 mm that begins 50 mm over
  // the stylus ball. No corner of it may be below the top plane within the radius.
  const auto program = make_program(given.machine, given.control, options);
  ASSERT_TRUE(program);
  const auto hidden = given.hidden(options.ball);
  for (const JointVector& q : program->chosen.poses) {
    const double a = q[*given.machine.axis("A")] * kDegreePerRad;
    const double c = q[*given.machine.axis("C")] * kDegreePerRad;
    const auto ball = hidden.ball_at(a, c);
    for (int i = 0; i < 360; i += 5) {
      for (double up = 50.0; up <= 150.0; up += 10.0) {
        const test::Triple p{ball[0] + 60.0 * std::cos(i * kRadPerDegree),
                             ball[1] + 60.0 * std::sin(i * kRadPerDegree), ball[2] + up};
        const auto back = test::turned(test::plus(p, hidden.a_point, -1.0), hidden.a_direction, -a);
        const auto on_c = test::plus(test::plus(hidden.a_point, back), hidden.c_point, -1.0);
        EXPECT_FALSE(on_c[2] < 5.0 && std::hypot(on_c[0], on_c[1]) < 200.0) << a << " " << c;
      }
    }
  }
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
