// Words that are sent ahead for axes that follow late, run behind servos of the test's own.
#include "post/making/servo_lead.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <stdexcept>

#include "post/judging/late_axes.hpp"
#include "post/posting.hpp"
#include "support/cases.hpp"
#include "support/controllers.hpp"

namespace trunnion::post {
namespace {

constexpr double kTolerance_mm = 0.01;
constexpr double kLever_mm = 100.0;  // of rad, where all axes have one measure

using Measure = Eigen::Matrix<double, kMaxAxes, 1>;

Measure measured(const Machine& machine, const JointVector& q) {
  Measure out;
  for (AxisId id = 0; id < kMaxAxes; ++id)
    out[static_cast<int>(id)] = q[id] * (machine.axes[id].kind == AxisKind::rotary ? kLever_mm : 1.0);
  return out;
}

double off_polyline(const Measure& x, const std::vector<Measure>& path) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Measure way = path[i] - path[i - 1];
    const double share = std::clamp(way.dot(x - path[i - 1]) / way.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (x - path[i - 1] - share * way).norm());
  }
  return best;
}

struct Command {
  JointVector to;
  double seconds;
};

// The largest distance from the path at which axes are that follow these commands late, by steps of 0.1 ms
// of dx/dt = (c - x) / tau.
double largest_off(const Machine& machine, const JointVector& from, const std::vector<Command>& commands,
                   const JointVector& lag_s, const std::vector<Measure>& path) {
  constexpr double kStep_s = 1e-4;
  JointVector x = from, begin = from;
  double most = 0.0;
  for (const Command& command : commands) {
    const auto steps = static_cast<int>(std::ceil(command.seconds / kStep_s));
    for (int i = 1; i <= steps; ++i) {
      const JointVector c = JointVector::interpolate(begin, command.to, static_cast<double>(i) / steps);
      for (AxisId id = 0; id < kMaxAxes; ++id) {
        const double share = lag_s[id] > 0.0 ? 1.0 - std::exp(-command.seconds / steps / lag_s[id]) : 1.0;
        x[id] += (c[id] - x[id]) * share;
      }
      most = std::max(most, off_polyline(measured(machine, x), path));
    }
    begin = command.to;
  }
  return most;
}

struct RandomRun {
  std::vector<JointVector> q;
  std::vector<double> seconds;  // of the block to each but the first
};

// Smooth in all axes, now and then a corner; 20 to 60 mm/s.
RandomRun random_run(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  RandomRun out;
  out.q.emplace_back();
  Measure along = Measure::NullaryExpr([&] { return u(random); });
  const double feed = 40.0 + 20.0 * u(random);
  for (int i = 0; i < 30; ++i) {
    const double bend = u(random) > 0.9 ? 1.0 : 0.1;
    along = (along.normalized() + bend * Measure::NullaryExpr([&] { return u(random); })).normalized();
    const double step = 3.0 + 2.0 * u(random);
    JointVector next = out.q.back();
    for (AxisId id = 0; id < kMaxAxes; ++id)
      next[id] += step * along[static_cast<int>(id)] / (id < 3 ? 1.0 : kLever_mm);
    out.q.push_back(next);
    out.seconds.push_back(step / feed);
  }
  return out;
}

TEST(LongServoLead, LateAxesAreBroughtToTheirPath) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::mt19937_64 random(28);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  double most_led = 0.0, least_not = 1.0;
  const int rounds = 60;
  for (int round = 0; round < rounds; ++round) {
    const RandomRun run = random_run(random);
    JointVector lag_s;
    lag_s[static_cast<AxisId>(round % 5)] = 0.003 + 0.007 * u(random);
    if (round % 2 == 1) lag_s[static_cast<AxisId>((round + 2) % 5)] = 0.002 + 0.005 * u(random);
    ServoLead lead(machine, lag_s, kTolerance_mm);
    ASSERT_TRUE(lead.is_on());
    std::vector<Measure> path;
    for (const JointVector& q : run.q) path.push_back(measured(machine, q));
    std::vector<Command> plain, led;
    for (std::size_t i = 1; i < run.q.size(); ++i) {
      lead.add({run.q[i - 1], run.q[i], run.seconds[i - 1], {}});
      plain.push_back({run.q[i], run.seconds[i - 1]});
    }
    for (const auto& block : lead.take()) led.push_back({block.to, block.seconds});
    EXPECT_TRUE(lead.is_idle());
    EXPECT_EQ(led.back().to, run.q.back()) << "at rest nothing is led";
    for (const Command& command : led) EXPECT_GT(command.seconds, 0.0);
    most_led = std::max(most_led, largest_off(machine, run.q.front(), led, lag_s, path));
    least_not = std::min(least_not, largest_off(machine, run.q.front(), plain, lag_s, path));
  }
  // In the axes' own measure, where a radian counts as much as at a part's rim.
  EXPECT_LT(most_led, kTolerance_mm);
  EXPECT_GT(least_not, 2.0 * kTolerance_mm);
}

// X at 50 mm/s, 4 ms late: 0.2 mm ahead in the middle of a long straight block.
TEST(ServoLead, OnAStraightWayTheLeadIsTheDelayTimesTheSpeed) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  JointVector lag_s, to;
  lag_s[0] = 0.004;
  to[0] = 200.0;
  ServoLead lead(machine, lag_s, kTolerance_mm);
  lead.add({{}, to, 4.0, {}});
  double most = 0.0, x = 0.0, at_s = 0.0;
  for (const auto& block : lead.take()) {
    at_s += block.seconds;
    if (block.seconds > 1.0) most = block.to[0];
    EXPECT_GE(block.to[0], x);
    x = block.to[0];
  }
  EXPECT_EQ(x, 200.0);
  EXPECT_GT(at_s, 4.0);
  // The long piece ends where slowing down begins.
  const double slows_s = 200.0 / 50.0 - (most - 0.2) / 50.0;
  EXPECT_GT(slows_s, 0.0);
  EXPECT_LT(slows_s, 0.5);
}

// A corner of X and Y by 29 degrees, 60 mm/s, through which Z goes on at 36 mm/s: how much of a lead is left
// there, and the largest change of it in one block.
struct AtCorner {
  double lead_mm = 0.0, most_change_mm = 0.0;
};

AtCorner at_corner(AxisId late) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  JointVector lag_s, corner, end;
  lag_s[late] = 0.005;
  corner[0] = 40.0;
  corner[2] = 30.0;
  end[0] = 72.0;
  end[1] = 24.0;
  end[2] = 60.0;
  ServoLead lead(machine, lag_s, kTolerance_mm);
  lead.add({{}, corner, 50.0 / 60.0, {}});
  lead.add({corner, end, 50.0 / 60.0, {}});
  AtCorner out;
  double before = 0.0, nearest = 1.0;
  for (const auto& block : lead.take()) {
    const double by = block.by[late];
    out.most_change_mm = std::max(out.most_change_mm, std::abs(by - before));
    before = by;
    const double away = std::abs(block.to[0] - corner[0]);
    if (away > nearest) continue;
    nearest = away;
    out.lead_mm = std::abs(by);
  }
  return out;
}

// A block towards a corner in which the lead goes from that of its fast begin to that of its slow end sends
// the axis where it has to be for neither. It moves off at 4 mm/s, in blocks of some milliseconds.
TEST(ServoLead, TheLeadChangesInSmallSteps) {
  EXPECT_LT(at_corner(1).most_change_mm, 0.04);
  EXPECT_LT(at_corner(2).most_change_mm, 0.04);
}

// Z has no corner there; a control may stop all the same.
TEST(ServoLead, WhereAControlMayStopLittleIsLed) {
  EXPECT_LT(at_corner(2).lead_mm, 0.25 * kTolerance_mm);
}

TEST(ServoLead, NothingIsLedWhereNoAxisIsLate) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  EXPECT_FALSE(ServoLead(machine, {}, kTolerance_mm).is_on());
}

// Behind a block at an even speed v an axis is tau v (1 - exp(-t / tau)) short, and comes up after it.
TEST(LateAxes, FollowAFirstOrderLag) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const nc::Controller controller = with_axes_of(machine, test::shipped_controller("linuxcnc"));
  const ControlTimes times(machine, controller);
  JointVector lag_s;
  lag_s[0] = 0.02;
  LateAxes late(lag_s);
  ASSERT_TRUE(late.are_late());
  BlockEnd end;
  end.rapid = true;
  EXPECT_EQ(late.follow(end, times), end.q);
  end.rapid = false;
  end.feed_mode = nc::FeedMode::inverse_time;
  end.feed = controller.numbers.feed.quanta(nc::FeedMode::inverse_time, 1.0 / 0.05);
  end.q[0] = 2.0;  // 40 mm/s for 0.05 s
  end.q[1] = 1.0;
  const double behind = 0.02 * 40.0 * (1.0 - std::exp(-2.5));
  const JointVector x = late.follow(end, times);
  EXPECT_NEAR(x[0], 2.0 - behind, 1e-6);
  EXPECT_EQ(x[1], 1.0);
  end.q[1] = 3.0;  // X waits
  EXPECT_NEAR(late.follow(end, times)[0], 2.0 - behind * std::exp(-2.5), 1e-6);
  late.rest();
  end.q[1] = 4.0;
  EXPECT_EQ(late.follow(end, times)[0], 2.0);
}

// The words of a program with a servo lag are led: the verification passes on the late machine, and finds
// what is wrong where the machine is not late, and on the late one without a lead.
TEST(ServoLead, ProgramsAreVerifiedWhereLateAxesComeTo) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Model model = test::model_of(
      "[model]\nname = \"late\"\n[[effect]]\nid = \"servo_lag:A\"\n[effect.parameters]\ntau_ms = 6\n",
      machine);
  std::string cl = "MULTAX/ON\nLOADTL/1,LENGTH,100\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,2000\nRAPID\n";
  for (int i = 0; i <= 60; ++i) {
    const double s = 0.05 * i, tilt = 0.4 + 0.25 * std::sin(s), turn = 0.3 * s;
    if (i == 60) cl += "RAPID\n";
    cl += test::point_text(
        Vec3(30.0 * std::cos(0.4 * s), 30.0 * std::sin(0.4 * s), i % 60 == 0 ? 60.0 : 5.0),
        Vec3(std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), std::cos(tilt)));
  }
  cl += "FINI\n";
  const auto plain = test::posted(cl, machine);
  const auto led = test::posted(cl, machine, {}, "linuxcnc", &model);
  ASSERT_TRUE(plain.report && led.report) << led.report.error().text();
  EXPECT_TRUE(led.report->verification->passed());
  EXPECT_FALSE(led.report->verification->certified) << "nothing is proved between the ends of blocks";
  EXPECT_GT(led.report->verification->duration_s, plain.report->verification->duration_s);
  EXPECT_GT(led.report->largest_correction_mm, 2.0 * kTolerance_mm);
  EXPECT_LT(led.report->largest_correction_mm, 1.0);
  const auto on_late = [&](const std::string& nc, double lag_s) {
    const nc::Controller c = with_axes_of(machine, test::shipped_controller("linuxcnc"));
    VerifyOptions options;
    options.tolerance_mm = kTolerance_mm;
    options.lag_s[*machine.axis("A")] = lag_s;
    Diagnostics d;
    const auto report = verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                               {std::make_unique<test::TextOf>(nc), "part.nc"}, {machine, c, options}, d);
    if (!report) throw std::runtime_error(report.error().text());
    return *report;
  };
  EXPECT_LT(on_late(led.nc, 0.006).max_tip_deviation_mm, kTolerance_mm);
  EXPECT_GT(on_late(led.nc, 0.0).max_tip_deviation_mm, 2.0 * kTolerance_mm);
  EXPECT_GT(on_late(led.nc, -0.006).max_tip_deviation_mm, 2.0 * kTolerance_mm);
  EXPECT_GT(on_late(plain.nc, 0.006).max_tip_deviation_mm, 2.0 * kTolerance_mm);
  // Travel, speeds and times are those of the words, wherever the axes come to.
  const VerifyReport late = on_late(led.nc, 0.006), words = on_late(led.nc, 0.0);
  ASSERT_EQ(late.travel.size(), words.travel.size());
  for (std::size_t i = 0; i < late.travel.size(); ++i) {
    EXPECT_EQ(late.travel[i].smallest, words.travel[i].smallest) << i;
    EXPECT_EQ(late.travel[i].largest, words.travel[i].largest) << i;
  }
  EXPECT_EQ(late.duration_s, words.duration_s);
  EXPECT_EQ(late.max_speed_ratio, words.max_speed_ratio);
}

// Without a lead a corner is cut inside by what all axes are late, and so it is in words of the part's frame:
// that is said.
TEST(ServoLead, TheLagOfAllAxesIsLedOrSaid) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Model model = test::model_of("[model]\nname = \"late\"\nlag_of_all_axes_ms = 6\n", machine);
  const std::string cl =
      "LOADTL/1,LENGTH,100\nFEDRAT/MMPM,2000\nRAPID\nGOTO/0,0,60\nGOTO/0,0,5\nGOTO/20,0,5\nGOTO/"
      "20,20,5\nFINI\n";
  const auto led = test::posted(cl, machine, {}, "linuxcnc", &model);
  ASSERT_TRUE(led.report) << led.report.error().text();
  EXPECT_TRUE(led.report->verification->passed());
  VerifyOptions options;
  options.tolerance_mm = kTolerance_mm;
  for (AxisId id = 0; id < machine.axes.size(); ++id) options.lag_s[id] = 0.006;
  const auto tip_mm = [&](const std::string& nc) {
    Diagnostics d;
    const nc::Controller c = with_axes_of(machine, test::shipped_controller("linuxcnc"));
    return verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                  {std::make_unique<test::TextOf>(nc), "part.nc"}, {machine, c, options}, d)
        .value()
        .max_tip_deviation_mm;
  };
  EXPECT_LT(tip_mm(led.nc), kTolerance_mm);
  const auto plain = test::posted(cl, machine);
  ASSERT_TRUE(plain.report);
  EXPECT_GT(tip_mm(plain.nc), 10.0 * kTolerance_mm);
  PostOptions of_part;
  of_part.rtcp = true;
  const auto part = test::posted(cl, machine, of_part, "fanuc_30i", &model);
  ASSERT_TRUE(part.report) << part.report.error().text();
  const auto& said = part.diagnostics.findings();
  EXPECT_EQ(std::count_if(said.begin(), said.end(),
                          [](const Finding& f) { return f.message.find("lag_of_all_axes_ms") == 0; }),
            1);
}

// Seconds for milliseconds would send an axis ahead by centimetres.
TEST(ServoLead, NoServoIsThatLate) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Model model = test::model_of(
      "[model]\nname = \"late\"\n[[effect]]\nid = \"servo_lag:X\"\n[effect.parameters]\ntau_ms = 500\n",
      machine);
  const auto out = test::posted("GOTO/0,0,50\nGOTO/10,0,50\nFINI\n", machine, {}, "linuxcnc", &model);
  ASSERT_FALSE(out.report);
  EXPECT_TRUE(out.nc.empty());
  EXPECT_NE(out.report.error().text().find("of 0.5 s for X: more than 0.05 s"), std::string::npos)
      << out.report.error().text();
}

}  // namespace
}  // namespace trunnion::post
