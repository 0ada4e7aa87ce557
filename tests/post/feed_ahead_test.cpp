// F words that the axes reach: planned, written, read back.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <random>
#include <set>

#include "post/axis_speeds.hpp"
#include "post/posting.hpp"
#include "support/cases.hpp"
#include "support/controllers.hpp"

namespace trunnion::post {
namespace {

using test::accelerating;

using test::posted;

// Where the file says that an axis is at least so fast nothing else changes.
TEST(FeedAhead, WordsStayWhereNothingIsPlanned) {
  for (const std::string& control : test::shipped_controllers()) {
    const std::string cl = test::sample_path(6, 300);
    const auto without = posted(cl, test::shipped_machine("trunnion_offset"), {}, control);
    ASSERT_TRUE(without.report) << control;
    EXPECT_FALSE(without.report->verification->estimated_s) << control;
    PostOptions as_programmed;
    as_programmed.feeds_within_reach = false;
    EXPECT_EQ(posted(cl, accelerating(50.0, 1.0), as_programmed, control).nc, without.nc) << control;
    // Nor where no axis needs time.
    EXPECT_EQ(posted(cl, accelerating(1e9, 1e9), {}, control).nc, without.nc) << control;
    Machine partly = accelerating(50.0, 1.0);
    partly.axes[2].acceleration.reset();
    EXPECT_EQ(posted(cl, partly, {}, control).nc, without.nc) << control;
  }
}

TEST(FeedAhead, EveryFeedIsReachedOnEveryControl) {
  for (const std::string& control : test::shipped_controllers()) {
    for (const FeedOutput feed : {FeedOutput::inverse, FeedOutput::per_minute}) {
      const std::string cl = test::sample_path(6, 600);
      const Machine machine = accelerating(60.0, 1.0);
      PostOptions options;
      options.feed = feed;
      const auto planned = posted(cl, machine, options, control);
      options.feeds_within_reach = false;
      const auto today = posted(cl, machine, options, control);
      ASSERT_TRUE(planned.report && today.report) << control << planned.report.error().text();
      const VerifyReport& p = *planned.report->verification;
      const VerifyReport& t = *today.report->verification;
      EXPECT_TRUE(p.passed()) << control;
      EXPECT_EQ(p.feeds_not_reached, 0U) << control << " " << p.max_feed_excess;
      EXPECT_GT(t.feeds_not_reached, 20U) << control;
      EXPECT_GT(t.max_feed_excess, 1.5) << control;
      // The machine is as fast as before, and the words tell it.
      EXPECT_NEAR(*p.estimated_s, *t.estimated_s, 0.03 * *t.estimated_s) << control;
      EXPECT_GT(p.duration_s, t.duration_s) << control;
      EXPECT_LT(p.duration_s, 1.01 * *p.estimated_s) << control;
    }
  }
}

// Where axes have a jerk, F words are planned with it, and read again they are reached.
TEST(FeedAhead, JerkIsKeptWhereAControlLooksAhead) {
  std::size_t slower = 0;
  for (const std::string& control : test::shipped_controllers()) {
    const std::string cl = test::sample_path(6, 600);
    Machine machine = accelerating(60.0, 1.0);
    const auto without = posted(cl, machine, {}, control);
    for (Axis& axis : machine.axes) axis.jerk = 10.0 * *axis.acceleration;
    const auto planned = posted(cl, machine, {}, control);
    PostOptions options;
    options.feeds_within_reach = false;
    const auto today = posted(cl, machine, options, control);
    ASSERT_TRUE(without.report && planned.report && today.report) << control;
    const VerifyReport& w = *without.report->verification;
    const VerifyReport& p = *planned.report->verification;
    EXPECT_TRUE(p.passed()) << control;
    EXPECT_GE(*p.estimated_s, 0.999 * *w.estimated_s) << control;
    if (planned.nc == without.nc) continue;  // stops, or looks one block ahead
    ++slower;
    EXPECT_GT(*p.estimated_s, 1.01 * *w.estimated_s) << control;
    EXPECT_LT(p.max_feed_excess, 1.1) << control;
    EXPECT_GT(today.report->verification->max_feed_excess, 1.5) << control;
    EXPECT_LT(p.duration_s, 1.01 * *p.estimated_s) << control;
  }
  EXPECT_GT(slower, 2U);
}

// Short cuts with a rapid behind each, where a control that blends comes to rest with all of its
// acceleration: the words that are planned before are those that the verification asks for.
TEST(FeedAhead, TheLastBlockBeforeARapidIsAsFastAsItMayBe) {
  std::mt19937_64 random(28);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (int round = 0; round < 40; ++round) {
    std::string cl = "MULTAX/ON\nLOADTL/1,LENGTH,100\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,3000\n";
    for (int cut = 0; cut < 4; ++cut) {
      double x = 40.0 * u(random), y = 40.0 * u(random), tilt = 0.3;
      for (int i = 0; i < 5; ++i) {
        const bool rapid = i == 0 || i == 4;
        if (rapid) cl += "RAPID\n";
        char line[128];
        std::snprintf(line, sizeof line, "GOTO/%.5f,%.5f,%.5f,%.8f,0,%.8f\n", x, y, rapid ? 50.0 : 5.0,
                      std::sin(tilt), std::cos(tilt));
        cl += line;
        x += 3.0 * u(random);
        y += 3.0 * u(random);
        tilt += 0.03 * u(random);
      }
    }
    for (const double smoothing : {0.0, 0.005, 0.05}) {
      PostOptions options;
      options.smoothing_mm = smoothing;
      const auto out = posted(cl + "FINI\n", accelerating(1000.0, 10.0), options, "linuxcnc");
      ASSERT_TRUE(out.report) << round << " " << out.report.error().text();
      EXPECT_TRUE(out.report->verification->passed()) << round << " " << smoothing;
    }
  }
}

// Velocities of the words, block by block: what the axes need to change them, over what they can.
double largest_demand(const Machine& machine, const nc::Controller& c, const std::string& text) {
  double out = 0.0;
  std::vector<nc::Motion> motions;
  for (const nc::Block& block : test::nc_blocks(c, text)) {
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (motion == nullptr || motion->kind == nc::MotionKind::rapid) {
      if (motion != nullptr || std::holds_alternative<nc::Retract>(block)) motions.clear();
      continue;
    }
    motions.push_back(*motion);
    // From and to rest, and one block more: there F is what is reached at its end.
    if (motions.size() < 5) continue;
    const auto& q = motions;
    const std::size_t n = q.size() - 2;
    const double first_s = test::block_seconds(c, q[n - 2], q[n - 1]);
    const double then_s = test::block_seconds(c, q[n - 1], q[n]);
    for (const Axis& axis : machine.axes) {
      const nc::AxisLetter letter = *nc::axis_letter(axis.name);
      const auto at = [&](std::size_t i) { return c.numbers.axes.internal(letter, q[i].words[letter]); };
      const double digit = c.numbers.axes.quantum(letter) * (1.0 / first_s + 1.0 / then_s);
      const double change = std::abs((at(n) - at(n - 1)) / then_s - (at(n - 1) - at(n - 2)) / first_s);
      out = std::max(out, (change - digit) / (0.5 * (first_s + then_s)) / *axis.acceleration);
    }
  }
  return out;
}

// Ten points a millimetre at 6 m/min round corners of 1 to 3 mm.
std::string dense_path(unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double a = 1.0 + 2.0 * u(random), b = 6.0 * u(random), c = 0.3 * u(random);
  std::string out = "MULTAX/ON\nLOADTL/1\nSPINDL/RPM,8000,CLW\nRAPID\n";
  for (int i = 0; i < 3000; ++i) {
    const double s = 0.02 * i / a;
    if (i == 1) out += "FEDRAT/MMPM,6000\n";
    out += test::point_text({a * std::cos(s) + 0.3 * s, a * std::sin(2.0 * s + b), 0.2 * std::sin(s)},
                            test::tilted(0.5 + c * std::sin(0.7 * s), 0.4 * s));
  }
  return out + "FINI\n";
}

TEST(FeedAhead, DenseWordsAskForNoMoreThanAxesCan) {
  const Machine machine = accelerating(1000.0, 20.0);
  double largest_today = 0.0, largest = 0.0;
  // Few of the paths are steep: all are needed, in an instrumented build too.
  for (int seed = 0; seed < 10; ++seed) {
    const auto& control = seed % 2 == 0 ? "iso" : "siemens_840d_sl";  // without a largest F
    const nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
    const std::string cl = dense_path(static_cast<unsigned>(seed));
    PostOptions options;
    options.tolerance_mm = 0.005;
    const auto planned = posted(cl, machine, options, control);
    options.feeds_within_reach = false;
    const auto today = posted(cl, machine, options, control);
    ASSERT_TRUE(planned.report && today.report) << planned.report.error().text();
    EXPECT_TRUE(planned.report->verification->passed()) << seed;
    EXPECT_EQ(planned.report->verification->feeds_not_reached, 0U) << seed;
    largest = std::max(largest, largest_demand(machine, c, planned.nc));
    largest_today = std::max(largest_today, largest_demand(machine, c, today.nc));
  }
  EXPECT_LT(largest, 1.5);
  EXPECT_GT(largest_today, 3.0);
  std::printf("largest demand of the words: %.2f of the acceleration, as programmed %.2f\n", largest,
              largest_today);
}

TEST(FeedAhead, WordsDoNotDependOnThreads) {
  const Machine machine = accelerating(60.0, 1.0);
  for (const char* control : {"fanuc_30i", "linuxcnc"}) {
    PostOptions options;
    const auto one = posted(test::sample_path(9, 30000), machine, options, control);
    ASSERT_TRUE(one.report) << one.report.error().text();
    EXPECT_TRUE(one.report->verification->passed());
    for (const std::size_t threads : {2U, 7U}) {
      options.threads = threads;
      EXPECT_EQ(posted(test::sample_path(9, 30000), machine, options, control).nc, one.nc) << threads;
    }
  }
}

// Numbers behind F of the cuts, one after the other.
std::vector<std::size_t> places_of_feeds(const std::string& nc) {
  std::vector<std::size_t> out;
  for (std::size_t at = nc.find(" F"); at != std::string::npos; at = nc.find(" F", at + 2))
    out.push_back(at + 2);
  return out;
}

std::string with_feed(const std::string& nc, std::size_t at, double share) {
  const auto end = nc.find_first_of(" \n", at);
  const auto number = parse_number(std::string_view(nc).substr(at, end - at));
  std::string out = nc;
  return out.replace(at, end - at, fixed_text(number.value * share, 3));
}

// A block that could be faster fails, also among those that the axes slow down; one that asks for more than
// they reach is counted.
TEST(FeedAhead, EditedFeedsAreFound) {
  const Machine machine = accelerating(60.0, 1.0);
  const std::string cl = test::sample_path(6, 600);
  const auto p = posted(cl, machine, {}, "fanuc_30i");
  ASSERT_TRUE(p.report) << p.report.error().text();
  const auto places = places_of_feeds(p.nc);
  const auto whole = test::verified(p.nc, cl, machine, 0.01, "fanuc_30i");
  ASSERT_TRUE(whole && whole->passed());
  int found = 0;
  for (std::size_t i = 40; i + 40 < places.size(); i += places.size() / 12) {
    const auto slow = test::verified(with_feed(p.nc, places[i], 0.5), cl, machine, 0.01, "fanuc_30i");
    ASSERT_TRUE(slow) << slow.error().text();
    EXPECT_FALSE(slow->checks_ok()) << p.nc.substr(places[i] - 60, 80);
    const auto fast = test::verified(with_feed(p.nc, places[i], 1.4), cl, machine, 0.01, "fanuc_30i");
    ASSERT_TRUE(fast) << fast.error().text();
    EXPECT_TRUE(fast->feeds_not_reached > 0 || !fast->checks_ok()) << p.nc.substr(places[i] - 60, 80);
    ++found;
  }
  EXPECT_GT(found, 8);
}

// Words are corrected block by block, behind the plan: F stays as asked for, and a slow one fails.
TEST(FeedAhead, CompensatedProgramsKeepTheirFeeds) {
  const Machine machine = accelerating(60.0, 1.0);
  const std::string cl = test::sample_path(6, 600);
  std::mt19937_64 random(6);
  const Model errors = test::random_errors(machine, random);
  const ModelEvaluator truth(errors);
  PostOptions options;
  const auto p = posted(cl, machine, options, "fanuc_30i", &errors);
  options.feeds_within_reach = false;
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_EQ(p.nc, posted(cl, machine, options, "fanuc_30i", &errors).nc);
  const auto places = places_of_feeds(p.nc);
  int found = 0;
  for (std::size_t i = 40; i + 40 < places.size(); i += places.size() / 6) {
    const std::string nc = with_feed(p.nc, places[i], 0.02);
    const auto slow = test::verified(nc, cl, machine, 0.01, "fanuc_30i", false, &truth);
    ASSERT_TRUE(slow) << slow.error().text();
    EXPECT_FALSE(slow->checks_ok()) << p.nc.substr(places[i] - 60, 80);
    ++found;
  }
  EXPECT_GT(found, 3);
}

// FEDRAT/INVERS says how long a motion takes: planned feeds leave it alone.
TEST(FeedAhead, ATimedMotionKeepsItsTime) {
  std::string cl = test::sample_path(6, 600);
  const std::string per_minute = "FEDRAT/MMPM,1200\n";
  cl.replace(cl.find(per_minute), per_minute.size(), "FEDRAT/INVERS,300\n");
  PostOptions options;
  const auto planned = posted(cl, accelerating(60.0, 1.0), options, "fanuc_30i");
  options.feeds_within_reach = false;
  ASSERT_TRUE(planned.report) << planned.report.error().text();
  EXPECT_TRUE(planned.report->verification->passed());
  EXPECT_EQ(planned.nc, posted(cl, accelerating(60.0, 1.0), options, "fanuc_30i").nc);
}

}  // namespace
}  // namespace trunnion::post
