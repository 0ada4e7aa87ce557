// Arcs and drilling cycles: LinuxCNC's interpreter makes of our words what our reader makes of them.
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/nc/expand.hpp"

#include "linuxcnc/interpreter.hpp"
#include "support/controllers.hpp"

namespace trunnion {
namespace {

using nc::AxisLetter;

std::int64_t integer(std::mt19937_64& random, std::int64_t low, std::int64_t high) {
  return std::uniform_int_distribution<std::int64_t>(low, high)(random);
}

nc::Hole random_hole(std::mt19937_64& random, nc::AxisWords& at) {
  nc::Hole hole;
  hole.kind = static_cast<nc::Hole::Kind>(integer(random, 0, 3));
  const bool steps = hole.kind == nc::Hole::Kind::peck || hole.kind == nc::Hole::Kind::chip_break;
  hole.dwell_ms = steps ? 0 : integer(random, 0, 1) * integer(random, 1, 900);
  hole.feed = integer(random, 1000, 900000);
  hole.clear = at[AxisLetter::Z] - integer(random, 0, 60000);
  hole.bottom = hole.clear - integer(random, 1000, 300000);
  if (steps) hole.step = integer(random, (hole.clear - hole.bottom) / 20 + 1, hole.clear - hole.bottom - 1);
  if (integer(random, 0, 1) == 0) at.set(AxisLetter::Z, hole.clear);
  hole.words = at;
  return hole;
}

nc::Arc random_arc(std::mt19937_64& random, nc::AxisWords& at) {
  nc::Arc arc;
  arc.clockwise = integer(random, 0, 1) == 1;
  arc.feed = integer(random, 1000, 900000);
  const std::int64_t x = at[AxisLetter::X];
  const std::int64_t y = at[AxisLetter::Y];
  arc.center = {x + integer(random, -900000, 900000), y + integer(random, 1000, 900000)};
  if (integer(random, 0, 4) != 0) {
    const double radius =
        std::hypot(static_cast<double>(x - arc.center[0]), static_cast<double>(y - arc.center[1]));
    const double angle = static_cast<double>(integer(random, 0, 6283)) / 1000.0;
    at.set(AxisLetter::X, arc.center[0] + std::llround(radius * std::cos(angle)));
    at.set(AxisLetter::Y, arc.center[1] + std::llround(radius * std::sin(angle)));
  }
  if (integer(random, 0, 2) == 0) at.set(AxisLetter::Z, at[AxisLetter::Z] + integer(random, 1, 90000));
  arc.words = at;
  return arc;
}

std::vector<nc::Block> shapes(std::uint64_t seed, int count) {
  std::mt19937_64 random(seed);
  std::vector<nc::Block> blocks = {nc::ProgramStart{}, nc::Spindle{nc::SpindleTurn::clockwise, 900}};
  nc::AxisWords at;
  for (const auto letter : {AxisLetter::X, AxisLetter::Y, AxisLetter::Z, AxisLetter::A, AxisLetter::C})
    at.set(letter, 0);
  nc::Motion start;
  at.set(AxisLetter::Z, 500000);
  start.words = at;
  blocks.emplace_back(start);
  for (int i = 0; i < count; ++i) {
    switch (integer(random, 0, 2)) {
      case 0:
        blocks.emplace_back(random_arc(random, at));
        break;
      case 1: {
        nc::Hole hole = random_hole(random, at);
        for (std::int64_t more = integer(random, 0, 3); more >= 0; --more) {
          hole.words.set(AxisLetter::X, integer(random, -900000, 900000));
          if (integer(random, 0, 1) == 0) hole.words.set(AxisLetter::Y, integer(random, -900000, 900000));
          blocks.emplace_back(hole);
        }
        at = hole.words;
        break;
      }
      default: {
        nc::Motion motion;
        at.set(AxisLetter::Z, integer(random, -300000, 900000));
        at.set(AxisLetter::A, integer(random, -300000, 900000));
        motion.words = at;
        blocks.emplace_back(motion);
      }
    }
  }
  blocks.emplace_back(nc::ProgramEnd{});
  return blocks;
}

std::string four(double mm) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.4f", mm);
  return std::string(buffer) == "-0.0000" ? "0.0000" : buffer;
}

/// A motion with its end as text, an arc with centre and sense.
std::string motion_text(bool feed, double x, double y, double z) {
  return (feed ? "feed " : "rapid ") + four(x) + " " + four(y) + " " + four(z);
}

std::vector<std::string> ours(const nc::Controller& controller, const std::string& text) {
  std::vector<std::string> out;
  const auto mm = [](std::int64_t quanta) { return static_cast<double>(quanta) / 1e4; };
  for (const nc::Block& block : test::nc_blocks(controller, text)) {
    if (const auto* m = std::get_if<nc::Motion>(&block)) {
      out.push_back(motion_text(m->kind == nc::MotionKind::feed, mm(m->words[AxisLetter::X]),
                                mm(m->words[AxisLetter::Y]), mm(m->words[AxisLetter::Z])));
    } else if (const auto* arc = std::get_if<nc::Arc>(&block)) {
      out.push_back(motion_text(true, mm(arc->words[AxisLetter::X]), mm(arc->words[AxisLetter::Y]),
                                mm(arc->words[AxisLetter::Z])) +
                    " about " + four(mm(arc->center[0])) + " " + four(mm(arc->center[1])) +
                    (arc->clockwise ? " -1" : " 1"));
    } else if (const auto* hole = std::get_if<nc::Hole>(&block)) {
      for (const nc::Stroke& s : nc::strokes_of(*hole, controller.cycles, controller.numbers.axes))
        out.push_back(motion_text(!s.rapid, s.xyz_mm[0], s.xyz_mm[1], s.xyz_mm[2]));
    }
  }
  return out;
}

std::vector<std::string> theirs(const test::Interpreted& run) {
  std::vector<std::string> out;
  std::string before;
  for (const test::Straight& s : run.motions) {
    const std::string place = s.xyzabc[0] + " " + s.xyzabc[1] + " " + s.xyzabc[2];
    std::string text = (s.feed ? "feed " : "rapid ") + place;
    if (s.turns != 0) text += " about " + s.center[0] + " " + s.center[1] + " " + std::to_string(s.turns);
    // It repeats where it stands.
    if (s.turns != 0 || s.feed || place != before) out.push_back(text);
    before = place;
  }
  return out;
}

// Feed geared to the spindle by the pitch of our words, down to their bottom.
TEST(Rs274, TapsAsOurWordsSay) {
  if (!test::has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const auto controller = test::shipped_controller("linuxcnc");
  nc::AxisWords at;
  for (const auto letter : {AxisLetter::X, AxisLetter::Y, AxisLetter::Z, AxisLetter::A, AxisLetter::C})
    at.set(letter, 0);
  at.set(AxisLetter::X, 50000);
  at.set(AxisLetter::Z, 40000);
  nc::Motion above;
  above.words = at;
  std::vector<nc::Block> blocks = {nc::ProgramStart{}, nc::Spindle{nc::SpindleTurn::clockwise, 500}, above};
  const std::vector<std::pair<std::int64_t, const char*>> pitches = {
      {125000000, "1.250000"}, {127000000, "1.270000"}, {105833333, "1.058333"}};
  for (const auto& [pitch, text] : pitches) {
    nc::Hole hole;
    hole.kind = nc::Hole::Kind::tap;
    hole.clear = 40000;
    hole.bottom = -123456;
    hole.thread = {pitch, 500, nc::Thread::Hand::right};
    hole.feed = 625000;
    hole.words = at;
    blocks.emplace_back(hole);
  }
  blocks.emplace_back(nc::ProgramEnd{});
  const std::string text = test::nc_text(controller, blocks);
  const auto run = test::interpret(text);
  ASSERT_EQ(run.exit_code, 0) << run.messages << text;
  ASSERT_EQ(run.taps.size(), 6u) << text;
  const auto back = test::nc_blocks(controller, text);
  std::vector<nc::Hole> read;
  for (const nc::Block& block : back) {
    if (const auto* hole = std::get_if<nc::Hole>(&block)) read.push_back(*hole);
  }
  ASSERT_EQ(read.size(), 3u) << text;
  for (std::size_t i = 0; i < pitches.size(); ++i) {
    EXPECT_EQ(run.taps[2 * i].substr(0, 8), pitches[i].second);
    EXPECT_EQ(run.taps[2 * i + 1], "5.0000, 0.0000, -12.3456)");
    EXPECT_NEAR(static_cast<double>(read[i].thread.pitch), static_cast<double>(pitches[i].first), 50.0);
    EXPECT_EQ(read[i].thread.rpm, 500);
  }
}

TEST(Rs274, MakesTheSameOfArcsAndDrillingCycles) {
  if (!test::has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const auto controller = test::shipped_controller("linuxcnc");
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const std::string text = test::nc_text(controller, shapes(seed, 300));
    const test::Interpreted run = test::interpret(text);
    ASSERT_EQ(run.exit_code, 0) << run.messages;
    const auto a = ours(controller, text);
    const auto b = theirs(run);
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
      ASSERT_EQ(a[i], b[i]) << "motion " << i << " of seed " << seed << " behind "
                            << (i == 0 ? "" : a[i - 1]);
    }
    ASSERT_EQ(a.size(), b.size());
  }
}

// A square of feeds at one tilt, led in and out by lines.
std::vector<nc::Block> compensated_square(nc::CutterSide side, std::int64_t number) {
  std::vector<nc::Block> blocks = {nc::ProgramStart{}, nc::Spindle{nc::SpindleTurn::clockwise, 900}};
  nc::Motion motion;
  for (const auto letter : {AxisLetter::X, AxisLetter::Y, AxisLetter::Z, AxisLetter::A, AxisLetter::C})
    motion.words.set(letter, 300000);
  const auto go = [&](std::int64_t x, std::int64_t y) {
    motion.words.set(AxisLetter::X, x);
    motion.words.set(AxisLetter::Y, y);
    blocks.emplace_back(motion);
  };
  go(-50000, -50000);
  motion.kind = nc::MotionKind::feed;
  motion.feed = 500000;
  if (side != nc::CutterSide::off) blocks.emplace_back(nc::CutterCompensation{side, number});
  go(0, 0);
  go(0, 300000);
  go(400000, 300000);
  go(400000, 0);
  if (side != nc::CutterSide::off) blocks.emplace_back(nc::CutterCompensation{});
  go(500000, -50000);
  motion.words.set(AxisLetter::A, 100000);
  go(500000, 0);
  blocks.emplace_back(nc::ProgramEnd{});
  return blocks;
}

TEST(Rs274, AddsTheWearOfTheRegisterToTheSideThatWeMean) {
  if (!test::has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const auto controller = test::shipped_controller("linuxcnc");
  const auto run = [&](nc::CutterSide side, std::int64_t number) {
    const auto blocks = compensated_square(side, number);
    const std::string text = test::nc_text(controller, blocks);
    EXPECT_EQ(ours(controller, text).size(), 7U) << text;
    const auto out = test::interpret(text);
    EXPECT_EQ(out.exit_code, 0) << out.messages << text;
    return out.motions;
  };
  const auto plain = run(nc::CutterSide::off, 0);
  for (const auto side : {nc::CutterSide::left, nc::CutterSide::right}) {
    const auto none = run(side, 95);
    ASSERT_EQ(none.size(), plain.size());
    for (std::size_t i = 0; i < plain.size(); ++i) EXPECT_EQ(none[i].xyzabc, plain[i].xyzabc) << i;
    // 0.25 inch of diameter (the unit of its tool table): along +Y the tool goes to the left by half of it,
    // which is -X.
    const auto worn = run(side, 7);
    const double shift = (side == nc::CutterSide::left ? -0.125 : 0.125) * 25.4;
    const auto along_y = std::find_if(worn.begin(), worn.end(), [](const test::Straight& motion) {
      return motion.feed && std::stod(motion.xyzabc[1]) > 10.0;
    });
    ASSERT_NE(along_y, worn.end());
    EXPECT_NEAR(std::stod(along_y->xyzabc[0]), shift, 1e-4);
  }
}

}  // namespace
}  // namespace trunnion
