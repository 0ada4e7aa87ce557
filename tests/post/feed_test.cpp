// Speeds of the axes, read back from the NC text by formulas of this file's own.
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <random>
#include <set>

#include "trunnion/base/number_text.hpp"

#include "post/axis_speeds.hpp"
#include "post/feeds/feed_plan.hpp"
#include "post/posting.hpp"
#include "support/cases.hpp"
#include "support/controllers.hpp"

namespace trunnion::post {
namespace {

using test::posted;
using test::Speeds;
using test::speeds_of;

Machine slow_machine(const std::string& name) {
  Machine machine = test::shipped_machine(name);
  for (Axis& axis : machine.axes) {
    axis.max_feed = axis.kind == AxisKind::linear ? 1500.0 / 60.0 : 600.0 * kRadPerDegree / 60.0;
  }
  return machine;
}

TEST(AxisSpeed, EveryBlockKeepsItOnEveryControl) {
  for (const std::string& control : test::shipped_controllers()) {
    const bool can_approach = !test::shipped_controller(control).retract[2].empty();
    for (const char* name : {"trunnion_offset", "xyzac_trt"}) {
      const Machine machine = slow_machine(name);
      const nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
      for (const FeedOutput feed : {FeedOutput::inverse, FeedOutput::per_minute}) {
        PostOptions options;
        options.feed = feed;
        const auto p = posted(test::sample_path(6), machine, options, control);
        ASSERT_TRUE(p.report) << control << " " << p.report.error().text();
        const VerifyReport& v = *p.report->verification;
        EXPECT_TRUE(v.speeds_ok()) << control << " " << v.max_speed_ratio;
        const Speeds speeds = speeds_of(machine, c, p.nc);
        EXPECT_GT(speeds.blocks, 50U) << control;
        EXPECT_LE(speeds.worst_ratio, 1.0 + 1e-9) << control << " " << name;
        EXPECT_GT(speeds.worst_ratio, 0.99) << control;  // and it is used
        EXPECT_NEAR(speeds.worst_ratio, v.max_speed_ratio, 1e-6) << control;
        EXPECT_GT(p.report->feed_time_lost_s, 1.0) << control;
      }
    }
    EXPECT_TRUE(can_approach || control == "hnc_8") << control;
  }
}

std::set<std::string> feeds_of(const std::string& nc) {
  std::set<std::string> out;
  for (std::size_t at = nc.find(" F"); at != std::string::npos; at = nc.find(" F", at + 2)) {
    const auto end = nc.find_first_of(" \n", at + 2);
    const auto number = parse_number(std::string_view(nc).substr(at + 2, end - at - 2));
    if (number) out.insert(shortest_text(number.value));
  }
  return out;
}

// The programmed number, once, where no rotary axis moves: not one that rounding makes anew in every block.
TEST(ModalFeed, IsTheProgrammedOneInThreeAxisCuts) {
  std::mt19937_64 random(250);
  std::uniform_real_distribution<double> u(-30.0, 30.0);
  for (const char* axis : {",0,0,1\n", ",0,0.6,0.8\n"}) {
    std::string cl =
        "UNITS/MM\nMULTAX/ON\nLOADTL/1\nRAPID\nGOTO/0,0,60" + std::string(axis) + "FEDRAT/250,MMPM\n";
    for (int i = 0; i < 200; ++i) {
      cl += "GOTO/";
      for (int k = 0; k < 3; ++k)
        cl += (k > 0 ? "," : "") + fixed_text(0.1 * u(random) + (k == 2 ? 30.0 : 0.0), 4);
      cl += axis;
    }
    cl += "FINI\n";
    for (const std::string& control : test::shipped_controllers()) {
      for (const FeedOutput feed : {FeedOutput::inverse, FeedOutput::per_minute}) {
        PostOptions options;
        options.feed = feed;
        const auto p = posted(cl, test::shipped_machine("trunnion_offset"), options, control);
        ASSERT_TRUE(p.report) << control << " " << p.report.error().text();
        EXPECT_TRUE(p.report->verification->passed()) << control;
        EXPECT_EQ(feeds_of(p.nc), std::set<std::string>{"250"}) << control << axis;
      }
    }
  }
}

// One by one and a few at a time: the same to the last bit, straight blocks among others.
TEST(ModalFeed, RunsHaveItToo) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::mt19937_64 random(251);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (const char* control : {"linuxcnc", "iso", "heidenhain_tnc640"}) {
    const nc::Controller controller = test::shipped_controller(control);
    const FeedPlanner planner(machine, controller, FeedOutput::per_minute);
    std::size_t in_runs = 0;
    std::size_t as_programmed = 0;
    for (int i = 0; i < 2000; ++i) {
      std::vector<JointVector> q(40);
      std::vector<Vec3> tips(40);
      for (std::size_t k = 1; k < q.size(); ++k) {
        q[k] = q[k - 1];
        const double size = std::pow(10.0, 2.0 * u(random));
        for (AxisId id = 0; id < 3; ++id) q[k][id] += size * u(random);
        if (i % 3 == 0) q[k][3] += 0.01 * u(random);
        tips[k] = tips[k - 1] + Vec3(q[k][0] - q[k - 1][0], q[k][1] - q[k - 1][1], q[k][2] - q[k - 1][2]);
        if (i % 5 == 0) tips[k] += 0.05 * size * Vec3(u(random), u(random), u(random));
      }
      std::vector<FeedPlanner::Stop> stops;
      for (std::size_t k = 0; k < q.size(); ++k) stops.push_back({&q[k], &tips[k]});
      const double feed = std::pow(10.0, 1.5 + 1.5 * u(random));
      RunFeeds run;
      const std::size_t planned = planner.plan_run(stops, feed, run);
      for (std::size_t k = 0; k < planned; ++k) {
        const BlockFeed block = planner.plan(q[k], q[k + 1], (tips[k + 1] - tips[k]).norm(), feed);
        ASSERT_EQ(run.quanta[k], block.quanta) << control;
        ASSERT_EQ(run.seconds[k], block.seconds) << control;
        ASSERT_EQ(run.lost_s[k], block.lost_s) << control;
        ++in_runs;
        as_programmed += block.quanta == controller.numbers.feed.quanta(nc::FeedMode::per_minute, feed);
      }
    }
    EXPECT_GT(in_runs, 30000U) << control;
    EXPECT_GT(as_programmed, 4000U) << control;
    EXPECT_LT(as_programmed, in_runs) << control;
  }
}

TEST(AxisSpeed, ToolCentrePointControlKeepsItToo) {
  for (const char* control : {"fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640", "haas_ngc", "linuxcnc"}) {
    PostOptions options;
    options.rtcp = true;
    options.feed = FeedOutput::tip;
    const auto p = posted(test::sample_path(6), slow_machine("trunnion_offset"), options, control);
    ASSERT_TRUE(p.report) << control << " " << p.report.error().text();
    const VerifyReport& v = *p.report->verification;
    EXPECT_TRUE(v.passed()) << control << " " << v.max_speed_ratio;
    EXPECT_GT(v.max_speed_ratio, 0.9) << control;
  }
}

// The feed may change anywhere in a long cut: nothing but the F of a line tells the control, and the reader.
TEST(Feed, ChangesWithinLongCuts) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const std::string& control : test::shipped_controllers()) {
    if (test::shipped_controller(control).retract[2].empty()) continue;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      std::mt19937_64 random(seed);
      std::uniform_real_distribution<double> u(-1.0, 1.0);
      const Vec3 axis = seed % 2 == 0 ? Vec3(Vec3::UnitZ()) : test::tilted(0.4, 0.8);
      Vec3 tip(0, 0, 30);
      std::string cl = "LOADTL/1\nSPINDL/RPM,3000,CLW\nFEDRAT/MMPM,500\nRAPID\n" +
                       test::point_text(tip + 30.0 * axis, axis);
      for (int i = 0; i < 300; ++i) {
        if (u(random) > 0.9)
          cl += "FEDRAT/MMPM," + std::to_string(300 + 100 * static_cast<int>(4.0 * (1.0 + u(random)))) + "\n";
        cl += test::point_text(tip, axis);
        tip += Vec3(0.3, seed % 3 == 0 ? 0.2 * u(random) : 0.0, 0.2 * u(random));
      }
      cl += "RAPID\n" + test::point_text(tip + 30.0 * axis, axis) + "FINI\n";
      const test::Posted p = test::posted(cl, machine, {}, control);
      ASSERT_TRUE(p.report) << control << " " << seed << ": " << p.report.error().text();
      EXPECT_TRUE(p.report->verification->passed()) << control << " " << seed;
    }
  }
}

// The time of FEDRAT/INVERS is that of the motion, into however many blocks it goes.
TEST(InverseTime, OfAMotionIsThatOfAllItsBlocks) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string from = "LOADTL/1,LENGTH,100\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,600\n" +
                           test::point_text({0, 0, 0}, test::tilted(0.2, 0.3));
  const std::string to = test::point_text({30, 0, 40}, test::tilted(0.9, 0.6)) + "FINI\n";
  const auto by_time = test::posted(from + "FEDRAT/INVERS,6\n" + to, machine);
  const auto by_way = test::posted(from + "FEDRAT/MMPM,300\n" + to, machine);
  ASSERT_TRUE(by_time.report && by_way.report);
  EXPECT_TRUE(by_time.report->verification->passed());
  EXPECT_GT(by_time.report->points_inserted, 3U);
  EXPECT_NEAR(by_time.report->verification->duration_s, by_way.report->verification->duration_s, 0.05);
}

// Where the tip stands the rotary axes take that time, and the next motion is as fast as before.
TEST(InverseTime, OfATurnInPlaceIsKept) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string from = "LOADTL/1,LENGTH,100\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,600\n" +
                           test::point_text({10, 0, 20}, test::tilted(0.3, 0.3));
  const std::string turn = test::point_text({10, 0, 20}, test::tilted(0.5, 0.9));
  const std::string on =
      "FEDRAT/MMPM,600\n" + test::point_text({20, 0, 20}, test::tilted(0.5, 0.9)) + "FINI\n";
  for (const bool rtcp : {false, true}) {
    PostOptions options;
    options.rtcp = rtcp;
    if (rtcp) options.feed = FeedOutput::tip;
    const auto seconds = [&](const std::string& feed) {
      const auto p = test::posted(from + feed + turn + on, machine, options);
      EXPECT_TRUE(p.report && p.report->verification->passed());
      return p.report ? p.report->verification->duration_s : 0.0;
    };
    EXPECT_NEAR(seconds("FEDRAT/INVERS,6\n") - seconds("FEDRAT/INVERS,12\n"), 5.0, 0.05);
  }
}

// FEDRAT/INVERS asks for a time: of a motion in many blocks, and of a turn in place.
TEST(InverseTime, OfAnEditedProgramIsJudged) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = "LOADTL/1,LENGTH,100\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,600\n" +
                         test::point_text({10, 0, 20}, test::tilted(0.3, 0.3)) + "FEDRAT/INVERS,6\n" +
                         test::point_text({10, 0, 20}, test::tilted(0.5, 0.9)) +
                         test::point_text({30, 0, 40}, test::tilted(0.9, 0.6)) + "FINI\n";
  for (const char* control : {"linuxcnc", "iso", "siemens_840d_sl"}) {
    const auto p = test::posted(cl, machine, {}, control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    ASSERT_TRUE(p.report->verification->passed()) << control;
    const auto right = test::verified(p.nc, cl, machine, 0.01, control);
    ASSERT_TRUE(right && right->passed()) << control;
    std::vector<std::string> lines;
    std::istringstream in(p.nc);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    const auto begin = static_cast<std::size_t>(
        std::find_if(lines.begin(), lines.end(),
                     [](const std::string& line) { return line.find("G93") != std::string::npos; }) -
        lines.begin());
    // F of the lines from `first` to `last` times a factor.
    const auto passes = [&](double factor, std::size_t first, std::size_t last) {
      std::string text;
      for (std::size_t k = 0; k < lines.size(); ++k) {
        const auto f = lines[k].rfind(" F");
        const bool here = k >= first && k <= last && f != std::string::npos;
        text += here ? lines[k].substr(0, f + 2) + fixed_text(factor * std::stod(lines[k].substr(f + 2)), 3)
                     : lines[k];
        text += "\n";
      }
      const auto v = test::verified(text, cl, machine, 0.01, control);
      EXPECT_TRUE(v) << v.error().text();
      return v && v->passed();
    };
    EXPECT_TRUE(passes(1.0, begin, lines.size())) << control;
    for (const double factor : {0.9, 1.1}) EXPECT_FALSE(passes(factor, begin, lines.size())) << control;
    std::size_t changed = 0;
    for (std::size_t i = begin; i < lines.size(); ++i) {
      if (lines[i].rfind(" F") == std::string::npos) continue;
      EXPECT_FALSE(passes(0.2, i, i)) << control << ": " << lines[i];
      ++changed;
    }
    EXPECT_GT(changed, 8U) << control;
  }
}

// With one decimal of F a way of a digit or two lasts 0.6 s a digit at most, and slow axes that turn far need
// longer: such digits are held, or the block is divided.
TEST(AxisSpeed, TheSmallestFeedIsNotTooFastEither) {
  std::mt19937_64 random(13);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::size_t smallest = 0;
  for (int i = 0; i < test::cases(60); ++i) {
    Machine machine = slow_machine(i % 2 == 0 ? "trunnion_offset" : "xyzac_trt");
    for (Axis& axis : machine.axes) {
      const bool rotary = axis.kind == AxisKind::rotary;
      axis.rapid = axis.max_feed =
          rotary ? 300.0 * kRadPerDegree / kSecondsPerMinute : 500.0 / kSecondsPerMinute;
    }
    std::string cl = "LOADTL/1,LENGTH,100\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,20000\n";
    Vec3 tip(20.0 * u(random), 20.0 * u(random), 0.0);
    double tilt = 0.4;
    double turn = 0.5;
    for (int k = 0; k < 40; ++k) {
      tip += (k % 3 == 0 ? 4.0 : 0.002) * Vec3(u(random), u(random), u(random));
      tilt = std::clamp(tilt + 0.1 * u(random), 0.2, 1.0);
      turn += 0.15 * u(random);
      cl += test::point_text(tip, test::tilted(tilt, turn));
    }
    PostOptions options;
    options.rtcp = true;
    options.feed = FeedOutput::tip;
    options.tolerance_mm = 0.02;
    const char* control = i % 3 == 0 ? "haas_ngc" : "fanuc_30i";
    const auto p = test::posted(cl + "FINI\n", machine, options, control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_TRUE(p.report->verification->speeds_ok()) << p.report->verification->max_speed_ratio;
    if (p.nc.find(" F0.1\n") != std::string::npos) ++smallest;
  }
  EXPECT_GT(smallest, 0U);
}

// LinuxCNC runs such a block at its lowest linear rate, whatever the inverse time says.
TEST(AxisSpeed, BlocksThatHardlyMoveXyzKeepItToo) {
  const Machine machine = test::shipped_machine("paper");
  const nc::Controller controller = test::shipped_controller("linuxcnc");
  const FeedPlanner planner(machine, controller, FeedOutput::inverse);
  const AxisId c = *machine.axis("C");
  const AxisId z = *machine.axis("Z");
  std::mt19937_64 random(96);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::size_t per_minute = 0;
  std::size_t in_runs = 0;
  for (int i = 0; i < 100000; ++i) {
    JointVector b;
    b[c] = kPi * u(random);
    b[z] = 1e-4 * std::round(1.0 + 30.0 * u(random));
    const double least_s = planner.axes().slowest_axis_s({}, b);
    constexpr double kFast_mm_s = 500.0;
    const BlockFeed block = planner.plan({}, b, 10.0 * b[c], kFast_mm_s);
    ASSERT_GE(block.seconds, least_s * (1.0 - 1e-12)) << b[c] << " rad, " << b[z] << " mm";
    per_minute += block.other_mode;
    const JointVector a;
    const std::array tips_P{Vec3(0, 0, 0), Vec3(10.0 * b[c], 0, 0)};
    const std::array<FeedPlanner::Stop, 2> stops{{{&a, &tips_P[0]}, {&b, &tips_P[1]}}};
    RunFeeds run;
    if (planner.plan_run(stops, kFast_mm_s, run) == 0) continue;
    ++in_runs;
    ASSERT_GE(run.seconds[0], least_s * (1.0 - 1e-12)) << b[c] << " rad, " << b[z] << " mm";
  }
  EXPECT_GT(per_minute, 1000U);
  EXPECT_GT(in_runs, 1000U);
}

TEST(AxisSpeed, AFasterFInTheTextFailsTheVerification) {
  const Machine machine = slow_machine("trunnion_offset");
  const std::string cl = test::sample_path(6);
  auto text = posted(cl, machine).nc;
  ASSERT_TRUE(test::verified(text, cl, machine, 0.01)->passed());
  std::size_t changed = 0;
  for (std::size_t at = text.find(" F", text.find("G93")); at != std::string::npos;
       at = text.find(" F", at + 2)) {
    const auto end = text.find_first_of(" \n", at + 2);
    const auto number = parse_number(std::string_view(text).substr(at + 2, end - at - 2));
    text.replace(at + 2, end - at - 2, fixed_text(number.value * 1.01, 4));
    if (++changed == 40) break;
  }
  const auto v = test::verified(text, cl, machine, 0.01);
  ASSERT_TRUE(v);
  EXPECT_TRUE(v->within_tolerance());
  EXPECT_FALSE(v->passed());
  EXPECT_NEAR(v->max_speed_ratio, 1.01, 1e-3);
  ASSERT_FALSE(v->too_fast.empty());
  EXPECT_GT(v->too_fast[0].nc_line, 0U);
}

// The tip goes round the C axis: X Y Z stand, but for their rounding.
std::string round_the_table(double feed_mm_min) {
  std::string cl = "FEDRAT/MMPM," + fixed_text(feed_mm_min, 3) + "\nRAPID\n";
  for (int i = 0; i <= 200; ++i) {
    const double turn = 0.013 * i;
    cl += "GOTO/" + fixed_text(0.1 + 30 * std::cos(turn), 4) + "," + fixed_text(30 * std::sin(turn), 4) +
          ",5," + fixed_text(std::sin(0.5) * std::cos(turn), 9) + "," +
          fixed_text(std::sin(0.5) * std::sin(turn), 9) + "," + fixed_text(std::cos(0.5), 9) + "\n";
  }
  return cl;
}

void expect_no_digits(const nc::Controller& c, const std::string& text) {
  std::optional<nc::Motion> before;
  for (const nc::Block& block : test::nc_blocks(c, text)) {
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (motion == nullptr) continue;
    if (before && before->kind == nc::MotionKind::feed && motion->kind == nc::MotionKind::feed) {
      for (const nc::AxisLetter letter : {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z}) {
        EXPECT_EQ(motion->words[letter], before->words[letter]) << motion->source.line;
      }
    }
    before = *motion;
  }
}

// LinuxCNC issue 2410: 0.0002 mm beside a turn, and G93 runs at its lowest rate, 0.1 a minute.
TEST(RotaryOnly, BlocksCarryNoDigitsOfXYZ) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const nc::Controller c = test::shipped_controller("linuxcnc");
  for (const double feed : {30.0, 300.0}) {
    const std::string cl = round_the_table(feed);
    const auto p = posted(cl, machine);
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->certified_tip_deviation_mm;
    if (feed < 100.0) {  // faster, no block is below that rate
      EXPECT_GT(p.report->blocks_held, 20U);
      expect_no_digits(c, p.nc);
    }
    // 200 chords of 30 mm radius at the programmed feed.
    const double length = 200.0 * 60.0 * std::sin(0.0065);
    EXPECT_NEAR(speeds_of(slow_machine("trunnion_offset"), c, p.nc).feed_seconds, 60.0 * length / feed,
                0.002 * 60.0 * length / feed);
  }
}

// Where the digits are needed, because the tolerance is as fine as they are, the feed is given per minute.
TEST(RotaryOnly, DigitsThatTheToleranceNeedsGoOutPerMinute) {
  PostOptions options;
  options.tolerance_mm = 0.00015;
  options.nonlinear.method = path::Method::adaptive;
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto p = posted(round_the_table(30.0), machine, options);
  ASSERT_TRUE(p.report) << p.report.error().text();
  const double length = 200.0 * 60.0 * std::sin(0.0065);
  const nc::Controller c = test::shipped_controller("linuxcnc");
  EXPECT_NEAR(speeds_of(slow_machine("trunnion_offset"), c, p.nc).feed_seconds, 2.0 * length, 0.1 * length);
  EXPECT_TRUE(p.report->verification->speeds_ok());
}

}  // namespace
}  // namespace trunnion::post
