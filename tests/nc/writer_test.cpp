// What the writer says, word by word, on a small controller file of its own and on those that ship.
#include <cmath>
#include <cstdio>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/units.hpp"

#include "nc/digits.hpp"
#include "support/controllers.hpp"

namespace trunnion {
namespace {

using nc::AxisLetter;
using nc::FeedMode;
using nc::MotionKind;
using ::testing::HasSubstr;
using ::testing::Not;

nc::Motion move(MotionKind kind, std::initializer_list<std::pair<AxisLetter, std::int64_t>> words,
                std::int64_t feed = 0, FeedMode mode = FeedMode::per_minute) {
  nc::Motion m;
  m.kind = kind;
  m.feed = feed;
  m.feed_mode = mode;
  for (const auto& [letter, quanta] : words) m.words.set(letter, quanta);
  return m;
}

std::string text_of(const std::string& controller, std::vector<nc::Block> blocks) {
  blocks.insert(blocks.begin(), nc::ProgramStart{});
  return test::nc_text(test::shipped_controller(controller), blocks);
}

std::string refusal_of(const std::string& name, std::vector<nc::Block> blocks) {
  const auto controller = test::shipped_controller(name);
  blocks.insert(blocks.begin(), nc::ProgramStart{});
  std::string text;
  nc::Writer writer(controller, text);
  for (const auto& block : blocks) {
    if (auto done = writer.write(block); !done) return done.error().message;
  }
  return "";
}

// Against printf, which is somebody else's code.
TEST(Digits, AreThoseOfPrintf) {
  std::mt19937_64 random(5);
  std::uniform_int_distribution<std::int64_t> small(-3000000, 3000000);
  std::uniform_int_distribution<std::int64_t> large(-999999999999999, 999999999999999);
  for (int i = 0; i < 200000; ++i) {
    const std::int64_t quanta = i % 2 == 0 ? small(random) : large(random);
    for (int decimals = 0; decimals <= nc::kMaxDecimals; ++decimals) {
      std::array<char, 40> buffer{};
      char* const end = nc::put_number(buffer.data(), quanta, {.decimals = decimals});
      const auto scale = static_cast<std::uint64_t>(nc::power_of_ten(decimals));
      const auto magnitude = static_cast<std::uint64_t>(std::abs(quanta));
      std::array<char, 40> expected{};
      const char* const sign = quanta < 0 ? "-" : "";
      int length = 0;
      if (decimals == 0) {
        length = std::snprintf(expected.data(), expected.size(), "%s%llu", sign,
                               static_cast<unsigned long long>(magnitude));
      } else {
        length = std::snprintf(expected.data(), expected.size(), "%s%llu.%0*llu", sign,
                               static_cast<unsigned long long>(magnitude / scale), decimals,
                               static_cast<unsigned long long>(magnitude % scale));
      }
      ASSERT_LT(length, 40);
      ASSERT_EQ(std::string(buffer.data(), end), expected.data());
    }
  }
}

TEST(Digits, FollowTheStyleOfTheControl) {
  const auto text = [](std::int64_t quanta, nc::NumberStyle style) {
    std::array<char, 40> buffer{};
    return std::string(buffer.data(), nc::put_number(buffer.data(), quanta, style));
  };
  EXPECT_EQ(text(0, {.decimals = 3}), "0.000");
  EXPECT_EQ(text(0, {.decimals = 3, .plus_sign = true}), "+0.000");
  EXPECT_EQ(text(1500, {.decimals = 3, .trailing_zeros = false}), "1.5");
  EXPECT_EQ(text(2000, {.decimals = 3, .trailing_zeros = false}), "2");
  EXPECT_EQ(text(2000, {.decimals = 3, .trailing_zeros = false, .point_required = true}), "2.");
  EXPECT_EQ(text(-5, {.decimals = 4}), "-0.0005");
  EXPECT_EQ(text(7, {.decimals = 0, .point_required = true}), "7.");
  EXPECT_EQ(text(INT64_MIN, {.decimals = 0}), "-9223372036854775808");
}

TEST(AxisFormat, RoundsToTheNearestQuantumOfMmAndDegrees) {
  const nc::AxisFormat format(4, 3);
  EXPECT_EQ(format.quanta(AxisLetter::X, 1.00005), 10001);
  EXPECT_EQ(format.quanta(AxisLetter::X, -0.00004), 0);
  EXPECT_EQ(format.quanta(AxisLetter::A, Angle::degrees(-30.0004).rad()), -30000);
  EXPECT_EQ(format.internal(AxisLetter::X, 12345), 1.2345);
  EXPECT_DOUBLE_EQ(format.internal(AxisLetter::C, 180000), kPi);
  EXPECT_EQ(format.turn(), 360000);
  std::mt19937_64 random(3);
  std::uniform_int_distribution<std::int64_t> quanta(-4000000000, 4000000000);
  for (int i = 0; i < 100000; ++i) {
    const auto q = quanta(random);
    ASSERT_EQ(format.quanta(AxisLetter::Y, format.internal(AxisLetter::Y, q)), q);
    ASSERT_EQ(format.quanta(AxisLetter::B, format.internal(AxisLetter::B, q)), q);
  }
}

TEST(FeedFormat, ConvertsSecondsToMinutesAndNeverToZero) {
  const nc::FeedFormat format{3, 4};
  EXPECT_EQ(format.quanta(FeedMode::per_minute, 10.0), 600000);
  EXPECT_EQ(format.quanta(FeedMode::inverse_time, 1.0 / 60.0), 10000);
  EXPECT_EQ(format.quanta(FeedMode::inverse_time, 1e-12), 1);
  EXPECT_DOUBLE_EQ(format.internal(FeedMode::per_minute, 600000), 10.0);
  EXPECT_EQ(format.rotary_quanta(Angle::degrees(6.0).rad()), 360000);
}

// Its own shift stands behind the offset that is said again behind a tool change; where an offset takes back
// all shifts neither is said.
TEST(Writer, AShiftStaysInForceBehindAToolChange) {
  for (const auto& [control, behind] :
       {std::pair{"linuxcnc", "T2 M6\nG17 G21 G40 G80 G90 G94\nG61\nG54\nG52 X0.0100 Y0.0000 Z-0.0200\n"},
        {"siemens_840d_sl", "CYCLE800()\nN160 G54\nN170 TRANS X0.01 Y0 Z-0.02\n"},
        {"heidenhain_tnc640", "TOOL CALL 2 Z\n13 M126\n14 M30\n"}}) {
    const nc::Controller c = test::shipped_controller(control);
    nc::OffsetShift shift;
    shift.kind = nc::OffsetShift::Kind::add;
    shift.offset = {100, 0, -200};
    nc::Motion motion;
    motion.kind = nc::MotionKind::rapid;
    motion.words.set(nc::AxisLetter::X, 10000);
    const std::vector<nc::Block> blocks = {
        nc::ProgramStart{}, nc::WorkOffset{1}, nc::ToolCall{1, 1}, shift, motion,
        nc::ToolCall{2, 2}, nc::ProgramEnd{}};
    const std::string text = test::nc_text(c, blocks);
    EXPECT_THAT(text, ::testing::HasSubstr(behind)) << control;
    const auto back = test::nc_blocks(c, text);
    EXPECT_EQ(std::count_if(back.begin(), back.end(),
                            [](const nc::Block& b) { return std::holds_alternative<nc::OffsetShift>(b); }),
              1)
        << text;
  }
}

TEST(Writer, WritesWordsOnlyWhenTheyChange) {
  const auto text =
      text_of("linuxcnc", {move(MotionKind::rapid, {{AxisLetter::X, 10000}, {AxisLetter::Y, 0}}),
                           move(MotionKind::rapid, {{AxisLetter::X, 20000}, {AxisLetter::Y, 0}}),
                           move(MotionKind::feed, {{AxisLetter::X, 20000}, {AxisLetter::Y, 5}}, 500000),
                           move(MotionKind::feed, {{AxisLetter::X, 20000}, {AxisLetter::Y, 6}}, 500000)});
  EXPECT_THAT(text, HasSubstr("\nG0 X1.0000 Y0.0000\nX2.0000\nG1 Y0.0005 F500.000\nY0.0006\n"));
}

TEST(Writer, LeavesOutAMotionThatMovesNothing) {
  const auto controller = test::shipped_controller("linuxcnc");
  std::string text;
  nc::Writer writer(controller, text);
  ASSERT_TRUE(writer.write(nc::ProgramStart{}));
  ASSERT_TRUE(writer.write(nc::Block(move(MotionKind::rapid, {{AxisLetter::X, 5}}))));
  const auto before = text;
  ASSERT_TRUE(writer.write(move(MotionKind::feed, {{AxisLetter::X, 5}}, 100)));
  EXPECT_EQ(text, before);
  EXPECT_EQ(writer.motions(), 1U);
}

TEST(Writer, GivesFInEveryBlockOfInverseTimeAndReturnsToFeedPerMinute) {
  const auto inverse = [](std::int64_t x) {
    return move(MotionKind::feed, {{AxisLetter::X, x}}, 25000, FeedMode::inverse_time);
  };
  const auto text =
      text_of("linuxcnc", {inverse(1), inverse(2), move(MotionKind::feed, {{AxisLetter::X, 3}}, 700000),
                           inverse(4), nc::ProgramEnd{}});
  EXPECT_THAT(
      text,
      HasSubstr(
          "G93 G1 X0.0001 F2.5000\nX0.0002 F2.5000\nG94 X0.0003 F700.000\nG93 X0.0004 F2.5000\nG94\nM2\n"));
}

TEST(Writer, HasNoToolWordsWithoutAToolChange) {
  const auto text = text_of("linuxcnc", {nc::Spindle{nc::SpindleTurn::clockwise, 1000},
                                         move(MotionKind::rapid, {{AxisLetter::X, 1}}), nc::ProgramEnd{}});
  EXPECT_THAT(text, Not(HasSubstr("T")));
  EXPECT_THAT(text, Not(HasSubstr("M6")));
}

TEST(Writer, ChoosesTheExactPathUnlessToldOtherwise) {
  EXPECT_THAT(text_of("linuxcnc", {move(MotionKind::rapid, {{AxisLetter::X, 1}})}), HasSubstr("\nG61\nG0"));
  const auto blended = text_of("linuxcnc", {nc::PathMode{nc::PathModeKind::continuous, 20},
                                            move(MotionKind::rapid, {{AxisLetter::X, 1}})});
  EXPECT_THAT(blended, HasSubstr("\nG64 P0.0020\nG0"));
  EXPECT_THAT(blended, Not(HasSubstr("G61")));
}

TEST(Writer, BreaksLongCommentsAndKeepsTheirSignsHarmless) {
  const auto text =
      text_of("iso", {nc::Comment{"first (second) " + std::string(50, 'x') + " third \t\xc3\xa9"}});
  EXPECT_EQ(text, "%\nO1\n(FIRST [SECOND])\n(- " + std::string(50, 'X') + " THIRD)\n(- ?)\n");
}

TEST(Writer, RestartsBlockNumbersAtTheirEnd) {
  auto controller = test::shipped_controller("iso");
  controller.block_numbers.max = 30;
  const auto text = test::nc_text(controller, {nc::ProgramStart{}, nc::Stop{}, nc::Stop{}, nc::Stop{}});
  EXPECT_EQ(text, "%\nO1\nN10 G17 G21 G40 G49 G80 G90 G94\nN20 M0\nN30 M0\nN10 M0\n");
}

TEST(Writer, RefusesWhatTheControlCannotBeTold) {
  EXPECT_EQ(refusal_of("linuxcnc", {move(MotionKind::feed, {{AxisLetter::X, 1}})}),
            "LinuxCNC: a feed move without feed");
  EXPECT_THAT(refusal_of("hnc_8", {nc::Dwell{100}}),
              AllOf(HasSubstr("HNC-8: the controller file has no words for a dwell: [dwell] words in "),
                    HasSubstr("hnc_8.toml")));
  EXPECT_EQ(refusal_of("hnc_8", {move(MotionKind::feed, {{AxisLetter::X, 1}}, 5, FeedMode::inverse_time)}),
            "HNC-8: the control has no inverse-time feed");
  EXPECT_EQ(refusal_of("iso", {nc::WorkOffset{7}}),
            "ISO 6983 (Fanuc-like): work offset 7: the controller file has 6");
  EXPECT_EQ(refusal_of("iso", {nc::Spindle{nc::SpindleTurn::clockwise, 0}}),
            "ISO 6983 (Fanuc-like): the spindle is to turn at 0 rpm");
  EXPECT_THAT(refusal_of("linuxcnc", {nc::Raw{std::string(300, 'X')}}),
              HasSubstr("a line of 300 characters is longer than the 255 that the control takes"));
  EXPECT_THAT(refusal_of("heidenhain_tnc640", {move(MotionKind::feed, {{AxisLetter::X, 1}}, 100000000)}),
              HasSubstr("feed 100000 is beyond the largest that the control takes, 99999.999"));
}

// At the safe height the rotary axes turn first: compensation comes back with the motion that needs it.
TEST(Writer, RestoresCompensationAfterARetractWithTheFirstLinearMotion) {
  const auto program = [](const std::string& name, const nc::Block& compensation) {
    const auto c = test::shipped_controller(name);
    nc::Motion m = move(MotionKind::rapid, {{AxisLetter::X, 0}, {AxisLetter::Z, 0}, {AxisLetter::C, 0}});
    std::vector<nc::Block> blocks = {nc::ProgramStart{}, compensation, m, test::retract_to(c, -12.5)};
    m = move(MotionKind::rapid, {{AxisLetter::C, 90 * c.numbers.axes.turn() / 360}});
    blocks.emplace_back(m);
    blocks.emplace_back(move(MotionKind::rapid, {{AxisLetter::X, 0}, {AxisLetter::Z, 0}}));
    const auto text = test::nc_text(c, blocks);
    return text.substr(text.find(" Z0") + 3);
  };
  EXPECT_THAT(program("iso", nc::LengthCompensation{3}),
              HasSubstr(" G53 G0 Z-12.5\nN40 G0 C90.\nN50 G43 H3 X0. Z0.\n"));
  EXPECT_THAT(program("fanuc_30i", nc::TcpControl{true, 3}),
              HasSubstr(" G49\nN50 G53 G0 Z-12.5\nN60 G0 C90.\nN70 G43.4 H3 X0. Z0.\n"));
  EXPECT_THAT(program("siemens_840d_sl", nc::TcpControl{true, 3}),
              HasSubstr(" TRAFOOF\nN100 SUPA G0 Z-12.5 D0\nN110 G0 C=DC(90)\nN120 TRAORI\nN130 ORIMKS\nN140 "
                        "ORIAXES\nN150 X0 Z0\n"));
  EXPECT_THAT(program("linuxcnc", nc::LengthCompensation{3}),
              HasSubstr("\nG53 G0 Z-12.5000\nG0 C90.0000\nZ0.0000\n"));
}

// X and Y that were said before compensation began are other coordinates after it.
TEST(Writer, SaysAllLinearAxesInTheBlockThatStartsCompensation) {
  const auto text = text_of(
      "iso", {nc::LengthCompensation{4}, move(MotionKind::rapid, {{AxisLetter::C, 5000}}),
              move(MotionKind::rapid, {{AxisLetter::X, 1000}, {AxisLetter::Y, 0}}),
              move(MotionKind::rapid, {{AxisLetter::X, 1000}, {AxisLetter::Y, 0}, {AxisLetter::Z, 0}})});
  EXPECT_THAT(text, HasSubstr("N20 G0 C5.\nN30 X1. Y0.\nN40 G43 H4 X1. Y0. Z0.\n"));
}

// Half a turn or more cannot be told by an angle in [0, 360).
TEST(Writer, RefusesTurnsThatAModuloAxisWouldTakeTheOtherWay) {
  const auto turn_c = [](std::int64_t degrees) {
    return refusal_of("heidenhain_tnc640",
                      {move(MotionKind::rapid, {{AxisLetter::C, 0}}),
                       move(MotionKind::feed, {{AxisLetter::C, 10000 * degrees}}, 1000)});
  };
  EXPECT_EQ(turn_c(179), "");
  EXPECT_THAT(turn_c(180), HasSubstr("axis C turns by +180 degrees in one feed block"));
  EXPECT_THAT(turn_c(-200), HasSubstr("axis C turns by +200 degrees"));
}

}  // namespace
}  // namespace trunnion
