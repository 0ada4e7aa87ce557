// Words of programs that others wrote, resolved to absolute millimetres.
#include <cmath>
#include <gtest/gtest.h>

#include "support/controllers.hpp"

namespace trunnion::nc {
namespace {

constexpr int kDecimals = 9;

std::vector<Block> read(const std::string& text, const std::string& control = "linuxcnc") {
  Controller c = test::shipped_controller(control);
  c.numbers.axes = AxisFormat(kDecimals, kDecimals);
  ReaderOptions options;
  options.others = true;
  return test::nc_blocks(c, text, options);
}

double mm(const AxisWords& words, AxisLetter letter) {
  return AxisFormat(kDecimals, kDecimals).internal(letter, words[letter]);
}

template <class T>
std::vector<T> all_of(const std::vector<Block>& blocks) {
  std::vector<T> out;
  for (const Block& block : blocks)
    if (const auto* t = std::get_if<T>(&block)) out.push_back(*t);
  return out;
}

TEST(OtherWords, InchesAndIncrementsBecomeAbsoluteMillimetres) {
  const auto motions =
      all_of<Motion>(read("G20 G90\nG0 X1 Y2 Z.5 A30\nG91 G1 X.25 A5 F10\nG21 X-1.5\nG90 Y7\nM2\n"));
  ASSERT_EQ(motions.size(), 4u);
  EXPECT_DOUBLE_EQ(mm(motions[0].words, AxisLetter::X), 25.4);
  EXPECT_DOUBLE_EQ(mm(motions[0].words, AxisLetter::Z), 12.7);
  EXPECT_DOUBLE_EQ(mm(motions[1].words, AxisLetter::X), 31.75);
  EXPECT_DOUBLE_EQ(mm(motions[1].words, AxisLetter::Y), 50.8);
  EXPECT_EQ(motions[1].words[AxisLetter::A], 35'000'000'000);  // degrees have no unit of length
  EXPECT_DOUBLE_EQ(mm(motions[2].words, AxisLetter::X), 30.25);
  EXPECT_DOUBLE_EQ(mm(motions[3].words, AxisLetter::Y), 7.0);
  const FeedFormat feed = test::shipped_controller("linuxcnc").numbers.feed;
  EXPECT_NEAR(feed.internal(FeedMode::per_minute, motions[1].feed) * 60.0, 254.0, 1e-9);
}

TEST(OtherWords, ACircleByItsRadiusHasItsCentreOnTheRightSide) {
  struct Case {
    const char* line;
    double x, y;  // of the centre
  };
  // From (10, 0) to (0, 10): about the origin the short way against the clock.
  for (const Case& k : std::initializer_list<Case>{{"G3 X0 Y10 R10", 0, 0},
                                                   {"G2 X0 Y10 R10", 10, 10},
                                                   {"G3 X0 Y10 R-10", 10, 10},
                                                   {"G2 X0 Y10 R-10", 0, 0},
                                                   {"G3 X0 Y10 I-10 J0", 0, 0},
                                                   {"G3 X0 Y10 I-10", 0, 0},
                                                   {"G90.1 G3 X0 Y10 I0 J0", 0, 0}}) {
    const auto arcs = all_of<Arc>(read(std::string("G21 G90 G0 X10 Y0 Z0\nF100\n") + k.line + "\nM2\n"));
    ASSERT_EQ(arcs.size(), 1u) << k.line;
    EXPECT_NEAR(static_cast<double>(arcs[0].center[0]) * 1e-9, k.x, 1e-8) << k.line;
    EXPECT_NEAR(static_cast<double>(arcs[0].center[1]) * 1e-9, k.y, 1e-8) << k.line;
  }
}

TEST(OtherWords, CirclesGoOnAndRunInOtherPlanes) {
  const auto arcs = all_of<Arc>(
      read("G21 G90 G0 X10 Y0 Z0\nG3 X0 Y10 I-10 F100\nX-10 Y0 J-10\nG18 G2 Z-20 I0 K-10\nG1 X5\nM2\n"));
  ASSERT_EQ(arcs.size(), 3u);
  EXPECT_EQ(arcs[1].center, (std::array<std::int64_t, 2>{0, 0}));
  EXPECT_EQ(arcs[2].plane, 1);
  EXPECT_EQ(arcs[2].center[0], -10'000'000'000);  // Z
  EXPECT_EQ(arcs[2].center[1], -10'000'000'000);  // X
}

TEST(OtherWords, ACycleKeepsWhatItsLineLeavesOut) {
  const auto holes = all_of<Hole>(
      read("G21 G90 G0 X0 Y0 Z50\nG99 G83 X1 Y2 Z-10 R3 Q2.5 F80\nX5\nG83 Y9 Z-12\nG80\nG0 Z50\nM2\n"));
  ASSERT_EQ(holes.size(), 3u);
  EXPECT_DOUBLE_EQ(mm(holes[1].words, AxisLetter::X), 5.0);
  EXPECT_EQ(holes[2].step, 2'500'000'000);
  EXPECT_EQ(holes[2].bottom, -12'000'000'000);
  EXPECT_EQ(holes[2].clear, 3'000'000'000);
  EXPECT_DOUBLE_EQ(mm(holes[2].words, AxisLetter::Y), 9.0);
}

TEST(OtherWords, AxesThatWentHomeAreNotKnown) {
  const auto blocks = read("%\nG21 G90 G0 X1 Y2 Z3\nG91 G28 Z0\nG90 G0 X4\nG53 Y0\nG0 X5\nM2\n%\n");
  const auto motions = all_of<Motion>(blocks);
  ASSERT_EQ(motions.size(), 3u);
  EXPECT_TRUE(motions[1].words.has(AxisLetter::Y));
  EXPECT_FALSE(motions[1].words.has(AxisLetter::Z));
  EXPECT_FALSE(motions[2].words.has(AxisLetter::Y));
  EXPECT_EQ(all_of<Retract>(blocks).size(), 2u);
}

// The length counts along Z.
TEST(OtherWords, LengthCompensationLeavesXAndYKnown) {
  const auto motions = all_of<Motion>(read("G21 G90 G0 X1 Y2\nG43 H1 Z9\nM2\n"));
  ASSERT_EQ(motions.size(), 2u);
  EXPECT_EQ(motions[1].words.mask & kXyz, kXyz);
}

TEST(OtherWords, AreNoneOfAVerification) {
  const Controller c = test::shipped_controller("linuxcnc");
  for (const char* line : {"G20", "G91", "G18", "G2 X1 Y1 R1"}) {
    Diagnostics d;
    EXPECT_FALSE(read_program(c, std::string("G21 G0 X0 Y0 Z0\nG1 F1\n") + line + "\nM2\n", "v.nc", d))
        << line;
  }
}

}  // namespace
}  // namespace trunnion::nc
