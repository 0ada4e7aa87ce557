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

struct Place {
  double x, y, z;
};

std::vector<Place> ends(const std::string& text, const std::string& control) {
  std::vector<Place> out;
  for (const Motion& m : all_of<Motion>(read(text, control)))
    out.push_back({mm(m.words, AxisLetter::X), mm(m.words, AxisLetter::Y), mm(m.words, AxisLetter::Z)});
  return out;
}

void expect_at(const Place& p, double x, double y, double z) {
  EXPECT_NEAR(p.x, x, 2e-9);
  EXPECT_NEAR(p.y, y, 2e-9);
  EXPECT_NEAR(p.z, z, 2e-9);
}

TEST(OtherWords, ATurnLeadsWherePlaneGeometrySays) {
  const auto p = ends(
      "%\nG21 G90 G54\nG0 X0. Y0. Z50.\nG52 X1. Y2. Z3.\nG68 X10. Y-5. R30.\nG0 X20. Y0. Z40.\nG1 X25. "
      "F100.\nG91 Y4.\n"
      "G90 G69\nG1 X7. Y8. Z9.\nG52 X0. Y0. Z0.\nG1 X7. Y8. Z9.\nM30\n%\n",
      "fanuc_30i");
  ASSERT_EQ(p.size(), 6u);
  const auto turned = [](double x, double y) {
    const double a = std::acos(-1.0) / 6.0;
    return Place{1.0 + 10.0 + std::cos(a) * (x - 10.0) - std::sin(a) * (y + 5.0),
                 2.0 - 5.0 + std::sin(a) * (x - 10.0) + std::cos(a) * (y + 5.0), 0.0};
  };
  expect_at(p[1], turned(20, 0).x, turned(20, 0).y, 43.0);
  expect_at(p[2], turned(25, 0).x, turned(25, 0).y, 43.0);
  expect_at(p[3], turned(25, 4).x, turned(25, 4).y, 43.0);
  expect_at(p[4], 8.0, 10.0, 12.0);
  expect_at(p[5], 7.0, 8.0, 9.0);
}

TEST(OtherWords, FramesOfASecondKindAreShiftsAndTurnsOneInTheOther) {
  const auto p = ends(
      "G17 G710 G90 G94\nG0 X0 Y0 Z50\nTRANS X10 Y20\nATRANS Z1 ; and up\nAROT Z90\nG0 X=5 Y0 Z40\nG1 "
      "X=IC(5) F200\nG91 Y=AC(3) X1\nG90\n"
      "ROT RPL=-90\nG1 X10 Y1\nTRANS\nG1 X1 Y2 Z3\nM30\n",
      "siemens_840d_sl");
  ASSERT_EQ(p.size(), 6u);
  expect_at(p[1], 10.0, 25.0, 41.0);
  expect_at(p[2], 10.0, 30.0, 41.0);
  expect_at(p[3], 7.0, 31.0, 41.0);
  expect_at(p[4], 1.0, -10.0, 41.0);  // Z stays where it stood: nothing names it
  expect_at(p[5], 1.0, 2.0, 3.0);
}

TEST(OtherWords, ACircleByCRAndByAbsoluteCentres) {
  const auto arcs =
      all_of<Arc>(read("G17 G710 G90 G94\nG0 X10 Y0 Z0\nG3 X0 Y10 CR=10 F100\nG3 X-10 Y0 I=AC(0) J=AC(0)\nG3 "
                       "X0 Y-10 CR=-10\nM30\n",
                       "siemens_840d_sl"));
  ASSERT_EQ(arcs.size(), 3u);
  const AxisFormat format(kDecimals, kDecimals);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(format.internal(AxisLetter::X, arcs[i].center[0]), 0.0, 1e-8);
    EXPECT_NEAR(format.internal(AxisLetter::Y, arcs[i].center[1]), 0.0, 1e-8);
  }
  EXPECT_NEAR(format.internal(AxisLetter::X, arcs[2].center[0]), -10.0, 1e-8);  // the long way round
  EXPECT_NEAR(format.internal(AxisLetter::Y, arcs[2].center[1]), -10.0, 1e-8);
}

TEST(OtherWords, FeedPerRevolutionFollowsTheSpindle) {
  const auto motions = all_of<Motion>(
      read("G21 G90\nS1500 M3\nG0 X0 Y0 Z0\nG95 G1 X1 F0.2\nS3000\nX2\nG20 X1 F0.01\nG94 X3 F10\nM2\n"));
  ASSERT_EQ(motions.size(), 5u);
  const FeedFormat feed = test::shipped_controller("linuxcnc").numbers.feed;
  const double mm_min[] = {0.2 * 1500, 0.2 * 3000, 0.01 * 25.4 * 3000, 10 * 25.4};
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(feed.internal(FeedMode::per_minute, motions[i + 1].feed) * 60.0, mm_min[i], 0.06) << i;
}

TEST(OtherWords, IncrementsByPrefix) {
  const auto p = ends(
      "0 BEGIN PGM P MM\n1 L X+10 Y+5 Z+50 FMAX\n2 L IX+2.5 IZ-10 FMAX\n3 L Y+7 IX-1 F100\n4 M2\n5 END PGM P "
      "MM\n",
      "heidenhain_tnc640");
  ASSERT_EQ(p.size(), 3u);
  expect_at(p[1], 12.5, 5.0, 40.0);
  expect_at(p[2], 11.5, 7.0, 40.0);
}

// As LinuxCNC does: the values are those before the line. Its interpreter judges more of them
// (tests/linuxcnc/input).
TEST(OtherWords, VariablesOfOneLineAreSetTogether) {
  const auto p = ends("G21 G90\nG0 X0 Y0 Z0\n#1=5\n#1=1 #2=[#1+1]\nG1 X#1 Y#2 F100\nM2\n", "linuxcnc");
  ASSERT_EQ(p.size(), 2u);
  expect_at(p[1], 1.0, 6.0, 0.0);
}

TEST(OtherWords, SubprogramsRunAsOftenAsTheyAreCalled) {
  const auto p = ends(
      "%\nO1\nG21 G90\nG0 X0. Y0. Z0.\nF100.\n#101=2.5\nM98 P20 L2\nM98 P30\nG90 G1 Z9.\nM30\n"
      "O20\nG91 G1 X#101\nM98 P30\nM99\nO30\nG91 G1 Y[#101*2]\nM99\n%\n",
      "fanuc_30i");
  ASSERT_EQ(p.size(), 7u);
  expect_at(p[4], 5.0, 10.0, 0.0);
  expect_at(p[5], 5.0, 15.0, 0.0);
  expect_at(p[6], 5.0, 15.0, 9.0);
  const auto h = ends(
      "0 BEGIN PGM P MM\n1 L X+0 Y+0 Z+0 FMAX\n2 LBL 1\n3 L IX+1 F100\n4 CALL LBL 1 REP 3\n5 CALL LBL 2\n6 "
      "M2\n7 LBL 2\n8 L IY+4\n"
      "9 LBL 0\n10 END PGM P MM\n",
      "heidenhain_tnc640");
  ASSERT_EQ(h.size(), 6u);
  expect_at(h[5], 4.0, 4.0, 0.0);
}

TEST(OtherWords, WhatIsNotKnownIsRefusedByItsWord) {
  struct Case {
    const char* control;
    const char* text;
    const char* says;
  };
  const Case cases[] = {
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG1 X#5 F100.\nM30\n", "variable #5 has no value"},
      {"fanuc_30i", "G21 G90\nG0 X#5021\nM30\n", "is the control's"},
      {"fanuc_30i", "G21 G90\nM98 P31000\nM30\nO1000\nM99\n", "how often it is called is said by L"},
      {"fanuc_30i", "G21 G90\nM98 P7\nM30\n", "no O7"},
      {"fanuc_30i", "G21 G90\nM98 P7\nM30\nO7\nM98 P7\nM99\n", "more than 32 deep"},
      {"fanuc_30i", "G21 G90\nM98 P7\nM30\nO7\nG1 X1. F100.\n%\n", "does not come back"},
      {"fanuc_30i", "G21 G90\nM98 P7\nM30\nO7\nG1 X1. F100.\n", "does not come back"},
      {"haas_ngc", "G21 G90\nM98 P7\nM30\nO7\nG1 X1. F100.\nO8\nX2.\nM99\n", "does not come back"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG68 R30.\nM30\n", "X, Y and R"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG68 X0. Y0. R30.\nG18 G2 X1. Z1. R5. F100.\nM30\n",
       "across another plane"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG52 X5. Y0. Z0.\nG91 G0 X1.\nM30\n",
       "say a place in these coordinates first"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG68 X0. Y0. R30\nM30\n", "no decimal point"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nIF[#1EQ1]GOTO 10\nM30\n", "has no value"},
      {"fanuc_30i", "G21 G90\nG54\nG0 X0. Y0. Z0.\nG68 X0. Y0. R30.\nG55\nM30\n", "another work offset"},
      {"linuxcnc", "G21 G90\no1 while [1]\no1 endwhile\nM2\n", "is there a loop without end"},
      {"linuxcnc", "G21 G90\nG92 X1\nM2\n", "where X stands is not known"},
      {"linuxcnc", "G21 G90\nG0 X0 Y0 Z0\n#1=[1/0]\nM2\n", "a division by nothing"},
      {"linuxcnc", "G21 G90\nG0 X0 Y0 Z0\n#1=1 X2\nM2\n", "stands behind the value"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\n#1=1 #2=2\nM30\n", "stands behind the value"},
      {"linuxcnc", "G21 G90\nS100 M3\nG0 X0 Y0 Z0\nG95 G1 X1\nM2\n", "without F"},
      {"siemens_840d_sl", "G710 G90\nG0 X0 Y0 Z0\nROT X30\nM30\n", "tilts the part"},
      {"siemens_840d_sl", "G710 G90\nG0 X=10+R1\nM30\n", "not understood"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 CALL LBL 7\n2 M2\n3 END PGM P MM\n", "no 'LBL 7'"},
  };
  for (const Case& k : cases) {
    Controller c = test::shipped_controller(k.control);
    c.numbers.axes = AxisFormat(kDecimals, kDecimals);
    ReaderOptions options;
    options.others = true;
    Diagnostics found;
    EXPECT_FALSE(read_program(c, k.text, "p.nc", found, options)) << k.text;
    std::string all;
    for (const auto& f : found.findings()) all += f.text() + "\n";
    EXPECT_NE(all.find(k.says), std::string::npos) << k.text << all;
  }
}

}  // namespace
}  // namespace trunnion::nc
