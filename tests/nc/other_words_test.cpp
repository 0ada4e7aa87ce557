// Words of programs that others wrote, resolved to absolute millimetres.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/nc/expand.hpp"

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

std::string error_of(const std::string& control, const std::string& text) {
  try {
    read(text, control);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
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

// Where the tool goes behind a hole must be said, unless the control begins every program alike or both are
// one height.
TEST(OtherWords, ACycleSaysWhereTheToolReturns) {
  const auto errors = [](const char* control, const char* height) {
    Diagnostics d;
    ReaderOptions options;
    options.others = true;
    const std::string text =
        std::string("G21 G90\nG0 X0. Y0. Z") + height + "\nG81 X1. Y2. Z-10. R3. F80.\nG80\nM30\n";
    return read_program(test::shipped_controller(control), text, "p.nc", d, options) ? 0 : 1;
  };
  EXPECT_EQ(errors("linuxcnc", "50."), 1);
  EXPECT_EQ(errors("iso", "50."), 1);
  EXPECT_EQ(errors("linuxcnc", "3."), 0);
  EXPECT_EQ(errors("fanuc_30i", "50."), 0);
  EXPECT_EQ(errors("haas_ngc", "50."), 0);
}

// At a '%' the control stops reading: what stands behind one is not left out in silence.
TEST(OtherWords, NothingStandsBehindTheEndOfTheTape) {
  EXPECT_EQ(read("%\nG21 G90 G0 X0 Y0 Z0\nG1 X1 F9\n%\n").size(),
            read("G21 G90 G0 X0 Y0 Z0\nG1 X1 F9\nM2\n").size());
  EXPECT_EQ(read("G21 G90 G0 X0 Y0 Z0\nG1 X1 F9\n%\n\n").size(),
            read("G21 G90 G0 X0 Y0 Z0\nG1 X1 F9\nM2\n").size());
  Diagnostics d;
  ReaderOptions options;
  options.others = true;
  const auto blocks = read_program(test::shipped_controller("linuxcnc"),
                                   "G21 G90 G0 X0 Y0 Z0\n%\nG1 X1 F9\nM2\n", "p.nc", d, options);
  ASSERT_FALSE(blocks);
  EXPECT_NE(blocks.error().text().find("behind the '%' of line 2"), std::string::npos);
}

// "G187 P2" says nothing of the path; P2 beside an arc might be its turns.
TEST(OtherWords, WordsOfASilentLineAreSilentTogether) {
  const auto errors = [](const char* line) {
    Diagnostics d;
    ReaderOptions options;
    options.others = true;
    const std::string text = std::string("G21 G90\nG0 X10. Y0. Z5.\nF100.\n") + line + "\nM30\n";
    return read_program(test::shipped_controller("haas_ngc"), text, "p.nc", d, options) ? 0 : 1;
  };
  EXPECT_EQ(errors("G187 P2"), 0);
  EXPECT_EQ(errors("G2 I-10."), 0);
  EXPECT_EQ(errors("G2 I-10. P2"), 1);
  EXPECT_EQ(errors("G1 X5. P2"), 1);
}

// LinuxCNC stops at two motion words, Fanuc takes the last.
TEST(OtherWords, ABlockIsARapidOrAFeedMotion) {
  const auto errors = [](const char* control, const char* words) {
    Diagnostics d;
    ReaderOptions options;
    options.others = true;
    const std::string text = std::string("G21 G90\nG0 X0. Y0. Z5.\nF100.\n") + words + " X1.\nM30\n";
    return read_program(test::shipped_controller(control), text, "p.nc", d, options) ? 0 : 1;
  };
  for (const char* control : {"linuxcnc", "fanuc_30i", "haas_ngc", "iso"}) {
    EXPECT_EQ(errors(control, "G0 G1"), 1) << control;
    EXPECT_EQ(errors(control, "G1 G0"), 1) << control;
    EXPECT_EQ(errors(control, "G1 G1"), 0) << control;
    EXPECT_EQ(errors(control, "G0"), 0) << control;
  }
}

// LinuxCNC stops at the number of any O word that it passes by.
TEST(OtherWords, APartThatIsPassedByHasReadableOWords) {
  const auto errors = [](const char* word) {
    Diagnostics d;
    ReaderOptions options;
    options.others = true;
    const std::string text = std::string("G21 G90 G0 X0 Y0 Z0\nF1\n#1 = 0\no7 if [#1 EQ 2]\nG1 X1\n") + word +
                             " else\nG1 X2\no7 endif\nM2\n";
    return read_program(test::shipped_controller("linuxcnc"), text, "p.nc", d, options) ? 0 : 1;
  };
  EXPECT_EQ(errors("o7"), 0);
  EXPECT_EQ(errors("o-0.63"), 1);
}

// G98 said between holes returns to where the tool stood in front of the first, G99 to R.
TEST(OtherWords, G98AndG99BetweenHolesAreAboutTheNextOne) {
  for (const char* control : {"linuxcnc", "fanuc_30i", "haas_ngc"}) {
    const auto holes = all_of<Hole>(
        read("G21 G90\nG0 X0. Y0. Z50.\nG99 G81 X1. Y2. Z-10. R3. F80.\nX5.\nG98 X9.\nY7.\nG99 Y9.\nG80\nG0 "
             "Z50.\nM30\n",
             control));
    std::vector<double> back;
    back.reserve(holes.size());
    for (const Hole& hole : holes) back.push_back(mm(hole.words, AxisLetter::Z));
    EXPECT_EQ(back, (std::vector<double>{3.0, 3.0, 50.0, 50.0, 3.0})) << control;
  }
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

// Controls take the last of them, or none.
TEST(OtherWords, TwoWordsOfOneGroupInABlockAreRefused) {
  const auto block = [](const std::string& words) {
    return "G21 G90 G94 G17\nS100 M3\nG0 X0. Y0. Z0.\n" + words + " X1. F100.\nM30\n";
  };
  for (const char* two :
       {"G1 G90 G91", "G1 G91 G90", "G1 G20 G21", "G1 G17 G18", "G1 G94 G95", "G1 G95 G94", "G1 G93 G95"})
    EXPECT_THAT(error_of("fanuc_30i", block(two)), ::testing::HasSubstr("a second word of one group")) << two;
  for (const char* fine : {"G1 G90 G90", "G1 G17 G21 G90 G94", "G1 G95", "G91 G1 G17"})
    EXPECT_EQ(error_of("fanuc_30i", block(fine)), "") << fine;
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
  for (const char* control : {"fanuc_30i", "haas_ngc"}) {
    SCOPED_TRACE(control);
    const auto p = ends(
        "%\nG21 G90 G54\nG0 X0. Y0. Z50.\nG52 X1. Y2. Z3.\nG68 X10. Y-5. R30.\nG0 X20. Y0. Z40.\nG1 X25. "
        "F100.\nG91 Y4.\n"
        "G90\nG69\nG1 X7. Y8. Z9.\nG52 X0. Y0. Z0.\nG1 X7. Y8. Z9.\nM30\n%\n",
        control);
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
}

// In coordinates that are turned the place where a circle begins is turned there and back: the last digits
// are no way from its end to its beginning.
TEST(LongOtherWords, AFullCircleStaysOneInTurnedCoordinates) {
  std::mt19937 random(7);
  const auto draw = [&](double least, double most) {
    return std::round(1e3 * std::uniform_real_distribution<double>(least, most)(random)) * 1e-3;
  };
  const auto word = [](char letter, double value) { return std::string(1, letter) + fixed_text(value, 3); };
  const AxisFormat format(kDecimals, kDecimals);
  for (int i = 0; i < 1500; ++i) {
    const bool siemens = i % 2 == 1;
    const std::string turn = siemens ? "AROT Z" + fixed_text(draw(-180, 180), 3)
                                     : "G68 X" + fixed_text(draw(-9, 9), 3) + " Y" +
                                           fixed_text(draw(-9, 9), 3) + " R" + fixed_text(draw(-180, 180), 3);
    double x = draw(-30, 30), y = draw(-30, 30);
    std::string text = siemens ? "G710 G90\nG54\n" : "G21 G90\nG54\n";
    text += "G0 X0. Y0. Z50.\n" + turn + "\nG0 " + word('X', x) + " " + word('Y', y) + " Z5.\n";
    if (i % 3 != 0) {
      text += "G91\n";
      for (int k = 0; k < i % 3; ++k) {
        const double dx = draw(-5, 5), dy = draw(-5, 5);
        x += dx;
        y += dy;
        text += "G1 " + word('X', dx) + " " + word('Y', dy) + " F500.\n";
      }
      text += "G90\n";
    }
    const bool says_end = i % 5 != 0, helix = i % 7 == 0;
    text += std::string(i % 4 < 2 ? "G2" : "G3") + (says_end ? " " + word('X', x) + " " + word('Y', y) : "") +
            (helix ? " Z4." : "") + " " + word('I', draw(1, 9)) + " " + word('J', draw(-9, 9)) +
            " F500.\nM30\n";
    const auto arcs = all_of<Arc>(read(text, siemens ? "siemens_840d_sl" : "fanuc_30i"));
    ASSERT_EQ(arcs.size(), 1U) << text;
    ASSERT_NEAR(course_of(arcs[0], format, 0.01).sweep_rad, kTwoPi, 1e-9) << text;
  }
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
      read("G21 G90\nS1500 M3\nG0 X0 Y0 Z0\nG95 G1 X1 F0.2\nS3000\nX2\nG20\nX1 F0.01\nG94 X3 F10\nM2\n"));
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

std::vector<Motion> motions_of(const std::string& text, const std::string& control) {
  return all_of<Motion>(read(text, control));
}

TEST(OtherWords, VariablesWithNamesAreWordsOfAnAxis) {
  const auto m = motions_of(
      "G710 G90\nDEF REAL _X_HOME, _F=250.\nDEF INT _N=2\n_X_HOME=-365. R1=10\nG0 X=_X_HOME Y=-R1*(_N+1) "
      "Z=AC(R1)\n"
      "G1 X=IC(-R1/4) F=_F\nX=SQRT(16)+SIN(30) ; R1\nM30\n",
      "siemens_840d_sl");
  ASSERT_EQ(m.size(), 3u);
  EXPECT_DOUBLE_EQ(mm(m[0].words, AxisLetter::X), -365.0);
  EXPECT_DOUBLE_EQ(mm(m[0].words, AxisLetter::Y), -30.0);
  EXPECT_DOUBLE_EQ(mm(m[0].words, AxisLetter::Z), 10.0);
  EXPECT_DOUBLE_EQ(mm(m[1].words, AxisLetter::X), -367.5);
  EXPECT_NEAR(mm(m[2].words, AxisLetter::X), 4.5, 1e-9);
  const FeedFormat feed = test::shipped_controller("siemens_840d_sl").numbers.feed;
  EXPECT_NEAR(feed.internal(FeedMode::per_minute, m[1].feed) * 60.0, 250.0, 1e-9);
}

TEST(OtherWords, ParametersAreCalculated) {
  const auto m = motions_of(
      "0 BEGIN PGM P MM\n1 FN 0: Q1 =+5\n2 FN 1: Q2 = +Q1 + +2.5\n3 Q3 = Q2 * 2 - SIN 30\n4 FN 4: Q4 = +Q1 "
      "DIV +2\n"
      "5 L X+Q1 Y-Q2 Z+Q3 R0 FMAX\n6 L IX-Q4 F Q1\n7 M2\n8 END PGM P MM\n",
      "heidenhain_tnc640");
  ASSERT_EQ(m.size(), 2u);
  EXPECT_DOUBLE_EQ(mm(m[0].words, AxisLetter::X), 5.0);
  EXPECT_DOUBLE_EQ(mm(m[0].words, AxisLetter::Y), -7.5);
  EXPECT_NEAR(mm(m[0].words, AxisLetter::Z), 14.5, 1e-9);
  EXPECT_DOUBLE_EQ(mm(m[1].words, AxisLetter::X), 2.5);
}

TEST(OtherWords, AHelixOfSeveralTurnsRisesEvenly) {
  const std::string siemens = "G710 G90\nG0 X10 Y0 Z0\nG3 X0 Y10 Z-9 I-10 J0 TURN=2 F100\nM30\n";
  const std::string linuxcnc = "G21 G90\nG0 X10 Y0 Z0\nG3 X0 Y10 Z-9 I-10 J0 P3 F100\nM2\n";
  const std::string polar =
      "0 BEGIN PGM P MM\n1 L X+10 Y+0 Z+0 R0 FMAX\n2 CC X+0 Y+0\n3 CP IPA+810 IZ-9 DR+ F100\n4 M2\n5 END PGM "
      "P MM\n";
  for (const auto& [text, control] :
       {std::pair(siemens, "siemens_840d_sl"), {linuxcnc, "linuxcnc"}, {polar, "heidenhain_tnc640"}}) {
    const auto arcs = all_of<Arc>(read(text, control));
    ASSERT_EQ(arcs.size(), 3u) << text;
    EXPECT_NEAR(mm(arcs[0].words, AxisLetter::Z), -4.0, 2e-9) << text;  // a turn of 2.25
    EXPECT_NEAR(mm(arcs[1].words, AxisLetter::Z), -8.0, 2e-9) << text;
    EXPECT_NEAR(mm(arcs[2].words, AxisLetter::Z), -9.0, 2e-9) << text;
    EXPECT_NEAR(mm(arcs[1].words, AxisLetter::X), 10.0, 2e-9) << text;
    EXPECT_NEAR(mm(arcs[2].words, AxisLetter::Y), 10.0, 2e-9) << text;
    for (const Arc& arc : arcs) {
      EXPECT_NEAR(static_cast<double>(arc.center[0]), 0.0, 2.0) << text;
      EXPECT_FALSE(arc.clockwise);
    }
  }
}

TEST(OtherWords, PolarWordsLeadWhereTheirAnglesSay) {
  const std::string head = "0 BEGIN PGM P MM\n1 L X+10 Y+0 Z+5 R0 FMAX\n2 CC X+0 Y+0\n";
  const std::string tail = "8 M2\n9 END PGM P MM\n";
  const auto blocks = read(head +
                               "3 C X+0 Y+10 DR+ F100\n4 CP PA+180 DR+\n5 CR X+0 Y+10 R-10 DR+ M8\n"
                               "6 LP PR+20 PA+90 FMAX\n7 CC IX+1 IY-5\n8 CP IPA-90 DR-\n" +
                               tail,
                           "heidenhain_tnc640");
  const auto arcs = all_of<Arc>(blocks);
  ASSERT_EQ(arcs.size(), 4u);
  EXPECT_NEAR(mm(arcs[0].words, AxisLetter::Y), 10.0, 1e-9);
  EXPECT_NEAR(mm(arcs[1].words, AxisLetter::X), -10.0, 1e-9);
  EXPECT_NEAR(mm(arcs[1].words, AxisLetter::Y), 0.0, 1e-9);
  // From (-10, 0) to (0, 10) against the clock the long way: about the origin.
  EXPECT_NEAR(static_cast<double>(arcs[2].center[0]) * 1e-9, 0.0, 1e-8);
  EXPECT_NEAR(static_cast<double>(arcs[2].center[1]) * 1e-9, 0.0, 1e-8);
  const auto lines = all_of<Motion>(blocks);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[1].kind, MotionKind::rapid);
  EXPECT_NEAR(mm(lines[1].words, AxisLetter::X), 0.0, 1e-8);
  EXPECT_NEAR(mm(lines[1].words, AxisLetter::Y), 20.0, 1e-8);
  // The pole is (1, 15): from (0, 20) by a right angle with the clock to (6, 16).
  EXPECT_TRUE(arcs[3].clockwise);
  EXPECT_NEAR(mm(arcs[3].words, AxisLetter::X), 6.0, 1e-8);
  EXPECT_NEAR(mm(arcs[3].words, AxisLetter::Y), 16.0, 1e-8);
}

// As a post-processor for this control leads in: across Y and Z, then tangential.
// Heidenhain's manuals: F behind M128 is the feed of the axes that make up for the rotary ones.
TEST(OtherWords, TheFeedBehindM128IsNoneOfTheCut) {
  const FeedFormat feed = test::shipped_controller("heidenhain_tnc640").numbers.feed;
  for (const char* line : {"L X+5 F125\n3 M128 F9000", "L X+5 F125\n3 L M128 F9000",
                           "L X+5 F125\n3 L Y+1 M128 F9000", "L X+5 Y+1 F125 M128 F9000"}) {
    const auto motions = all_of<Motion>(
        read(std::string("0 BEGIN PGM P MM\n1 L X+0 Y+0 Z+0 FMAX\n2 ") + line + "\n4 L X+9 Y+9 Z+9\n5 M2\n",
             "heidenhain_tnc640"));
    EXPECT_NEAR(feed.internal(FeedMode::per_minute, motions.back().feed) * 60.0, 125.0, 0.01) << line;
  }
  const auto own = all_of<Motion>(
      read("0 BEGIN PGM P MM\n1 L X+0 Y+0 Z+0 FMAX\n2 L X+5 F200 M128\n3 M2\n", "heidenhain_tnc640"));
  EXPECT_NEAR(feed.internal(FeedMode::per_minute, own.back().feed) * 60.0, 200.0, 0.01);
}

// The sense of a circle is not that of its remark.
TEST(OtherWords, ARemarkHoldsNoWordsOfAPole) {
  for (const char* remark : {"", " ; was DR+", " ; was DR-", " ;DR+ IPA+5 R+9"}) {
    const auto arcs = all_of<Arc>(read(
        std::string("0 BEGIN PGM P MM\n1 L X+10 Y+0 Z+0 FMAX\n2 CC X+0 Y+0 ; X+5\n3 C X+0 Y+10 DR- F100") +
            remark + "\n4 M2\n",
        "heidenhain_tnc640"));
    ASSERT_EQ(arcs.size(), 1u) << remark;
    EXPECT_TRUE(arcs[0].clockwise) << remark;
    EXPECT_EQ(arcs[0].center, (std::array<std::int64_t, 2>{0, 0})) << remark;
  }
}

TEST(OtherWords, APoleInAnotherPlane) {
  const auto arcs =
      all_of<Arc>(read("0 BEGIN PGM P MM\n1 L X+37.996 Y+88.53 Z+2 R0 FMAX\n2 L Z+0.996 F1524\n3 CC  "
                       "Y+89.526  Z+0.996\n4 CP IPA+90 DR+\n"
                       "5 M2\n6 END PGM P MM\n",
                       "heidenhain_tnc640"));
  ASSERT_EQ(arcs.size(), 1u);
  EXPECT_EQ(arcs[0].plane, 2);
  EXPECT_NEAR(mm(arcs[0].words, AxisLetter::Y), 89.526, 1e-8);
  EXPECT_NEAR(mm(arcs[0].words, AxisLetter::Z), 0.0, 1e-8);
  EXPECT_NEAR(mm(arcs[0].words, AxisLetter::X), 37.996, 1e-8);
}

TEST(OtherWords, ADatumShiftCountsWithoutAndInATiltedPlane) {
  const auto blocks = read(
      "0 BEGIN PGM P MM\n1 CYCL DEF 7.0 DATUM SHIFT\n2 CYCL DEF 7.1 X+10\n3 CYCL DEF 7.2 IY+3\n4 L X+1 Y+2 "
      "Z+3 R0 FMAX\n"
      "5 PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN FMAX\n6 L X+1 Y+2 Z+3 FMAX\n7 CYCL DEF 7.0 DATUM SHIFT\n8 "
      "CYCL DEF 7.1 X+0\n"
      "9 PLANE RESET STAY\n10 L X+1 Y+2 Z+3 FMAX\n11 M2\n12 END PGM P MM\n",
      "heidenhain_tnc640");
  const auto m = all_of<Motion>(blocks);
  ASSERT_EQ(m.size(), 3u);
  EXPECT_DOUBLE_EQ(mm(m[0].words, AxisLetter::X), 11.0);
  EXPECT_DOUBLE_EQ(mm(m[0].words, AxisLetter::Y), 5.0);
  EXPECT_DOUBLE_EQ(mm(m[1].words, AxisLetter::X), 1.0);
  EXPECT_DOUBLE_EQ(mm(m[2].words, AxisLetter::X), 1.0);
  EXPECT_DOUBLE_EQ(mm(m[2].words, AxisLetter::Y), 5.0);
  const auto planes = all_of<TiltedPlane>(blocks);
  ASSERT_EQ(planes.size(), 2u);
  EXPECT_EQ(planes[0].origin, (std::array<std::int64_t, 3>{10'000'000'000, 3'000'000'000, 0}));
}

// A plain number of an axis that counts modulo one turn is gone to straight, over 350 degrees if need be.
TEST(OtherWords, AModuloAxisGoesTheWayThatItsWordSays) {
  const auto deg = [](const Motion& m) { return static_cast<double>(m.words[AxisLetter::C]) * 1e-9; };
  const auto s =
      motions_of("G710 G90\nG0 C10\nG0 C350\nG0 C=DC(10)\nG0 C=IC(400)\nG91 C-30\nM30\n", "siemens_840d_sl");
  ASSERT_EQ(s.size(), 5u);
  EXPECT_DOUBLE_EQ(deg(s[1]), 350.0);
  EXPECT_DOUBLE_EQ(deg(s[2]), 370.0);
  EXPECT_DOUBLE_EQ(deg(s[3]), 770.0);
  EXPECT_DOUBLE_EQ(deg(s[4]), 740.0);
  const auto h = motions_of(
      "0 BEGIN PGM P MM\n1 M126\n2 L C+10 R0 FMAX\n3 L C+350 FMAX\n4 M127\n5 L C+10 FMAX\n6 M2\n7 END PGM P "
      "MM\n",
      "heidenhain_tnc640");
  ASSERT_EQ(h.size(), 3u);
  EXPECT_DOUBLE_EQ(deg(h[1]), -10.0);
  EXPECT_DOUBLE_EQ(deg(h[2]), -350.0);
}

// Over the place that the line names, in the coordinates in force.
// Siemens: DC is the shorter way to a place, whatever G90 and G91 say.
TEST(OtherWords, TheShorterWayLeadsToAPlaceUnderIncrementsToo) {
  const auto motions = all_of<Motion>(
      read("G710 G90\nG0 X0 Y0 Z0 C30\nG91 G1 C=DC(40) F100\nX5 C=DC(20)\nC10\nM30\n", "siemens_840d_sl"));
  ASSERT_EQ(motions.size(), 4u);
  EXPECT_EQ(motions[1].words[AxisLetter::C], 40'000'000'000);
  EXPECT_EQ(motions[2].words[AxisLetter::C], 20'000'000'000);
  EXPECT_DOUBLE_EQ(mm(motions[2].words, AxisLetter::X), 5.0);
  EXPECT_EQ(motions[3].words[AxisLetter::C], 30'000'000'000);
}

TEST(OtherWords, AHolesFeedPerRevolutionFollowsTheSpindle) {
  const auto holes = all_of<Hole>(
      read("G21 G90\nG0 X0. Y0. Z9.\nS100 M3\nG95\nG81 X1. Y1. Z-1. R1. F.5\nX2.\nS200\nX3.\nG80\nM30\n",
           "fanuc_30i"));
  ASSERT_EQ(holes.size(), 3u);
  const FeedFormat feed = test::shipped_controller("fanuc_30i").numbers.feed;
  EXPECT_NEAR(feed.internal(FeedMode::per_minute, holes[1].feed) * 60.0, 50.0, 0.05);
  EXPECT_NEAR(feed.internal(FeedMode::per_minute, holes[2].feed) * 60.0, 100.0, 0.05);
}

// Haas, G254: behind a rotation X, Y and Z are to be said anew.
TEST(OtherWords, AZeroThatGoesWithThePartLeavesNoPlaceKnownWhenItTurns) {
  const auto motions = all_of<Motion>(
      read("G21 G90\nG0 A0. C0.\nG254\nG0 X1. Y2. Z3.\nG0 A30.\nG0 X4.\nA40. Y5.\nG255\nM30\n", "haas_ngc"));
  ASSERT_EQ(motions.size(), 5u);
  EXPECT_EQ(motions[1].words.mask & kXyz, kXyz);
  EXPECT_EQ(motions[2].words.mask & kXyz, 0);
  EXPECT_EQ(motions[3].words.mask & kXyz, AxisWords::bit(AxisLetter::X));
  EXPECT_EQ(motions[4].words.mask & kXyz, AxisWords::bit(AxisLetter::Y));
}

// What the rules against doubled words and doubtful heights must leave alone.
TEST(OtherWords, WhatStandsOnceIsTaken) {
  EXPECT_EQ(all_of<Motion>(read("% (PART 7)\nG21 G90 G17\nG0 X0. Y0. Z0. M3 S100 M8\nG1 X5. F100\nM30\n%\n",
                                "fanuc_30i"))
                .size(),
            2u);
  // Straight up to R, and back to it.
  EXPECT_EQ(
      all_of<Hole>(read("G21 G90\nG0 X0. Y0. Z1.\nG99 G81 Z-5. R2. F100.\nX5.\nG80\nM30\n", "fanuc_30i"))
          .size(),
      2u);
  EXPECT_EQ(all_of<Hole>(read("G21 G90\nG0 X0 Y0 Z1\nG98 G81 X1 Y1 Z-5 R2 F100\nG80\nM2\n")).size(), 1u);
  // LinuxCNC keeps its kinematics over a tool change.
  EXPECT_EQ(all_of<ToolCall>(read("G21 G90\nM428\nT1 M6\nM2\n")).size(), 1u);
}

TEST(OtherWords, AReferencePointIsGoneToByWayOfAPlace) {
  const auto m = motions_of(
      "G21 G90\nG0 X0. Y0. Z50.\nG28 Z80.\nG0 X0. Y0. Z50.\nG91 G28 Z5.\nG90\nG0 X0. Y0. Z50.\n"
      "G91 G28 Z0.\nM30\n",
      "fanuc_30i");
  ASSERT_EQ(m.size(), 5u);
  EXPECT_DOUBLE_EQ(mm(m[1].words, AxisLetter::Z), 80.0);
  EXPECT_EQ(m[1].kind, MotionKind::rapid);
  EXPECT_DOUBLE_EQ(mm(m[3].words, AxisLetter::Z), 55.0);
}

TEST(OtherWords, FUnderADrillingCycleIsThatOfTheHolesBehindIt) {
  const auto holes = all_of<Hole>(
      read("G21 G90\nG0 X0. Y0. Z50.\nG81 X1. Y1. Z-5. R5. F100.\nX2. F50.\nX3.\nG80\nM30\n", "fanuc_30i"));
  ASSERT_EQ(holes.size(), 3u);
  EXPECT_EQ(2 * holes[1].feed, holes[0].feed);
  EXPECT_EQ(holes[2].feed, holes[1].feed);
}

TEST(OtherWords, WhatIsNotKnownIsRefusedByItsWord) {
  struct Case {
    const char* control;
    const char* text;
    const char* says;
  };
  const Case cases[] = {
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG1 X#5 F100.\nM30\n", "variable #5 has no value"},
      {"fanuc_30i", "G21 G90\nG0 X#5021\nM30\n", "belongs to the control"},
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
      {"linuxcnc", "G21 G90\nG92 X1\nM2\n", "the position of X is unknown"},
      {"linuxcnc", "G21 G90\nG0 X0 Y0 Z0\n#1=[1/0]\nM2\n", "a division by nothing"},
      {"linuxcnc", "G21 G90\nG0 X0 Y0 Z0\n#1=1 X2\nM2\n", "text after the value"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\n#1=1 #2=2\nM30\n", "text after the value"},
      {"linuxcnc", "G21 G90\nS100 M3\nG0 X0 Y0 Z0\nG95 G1 X1\nM2\n", "without F"},
      {"siemens_840d_sl", "G710 G90\nG0 X0 Y0 Z0\nROT X30\nM30\n", "tilts the part"},
      {"siemens_840d_sl", "G710 G90\nG0 X=10+R1\nM30\n", "R1 has no value"},
      {"siemens_840d_sl", "G710 G90\nDEF REAL _A\n_B=5\nG0 X=_A\nM30\n", "'_B' is not understood"},
      // INT takes the nearest whole number.
      {"siemens_840d_sl", "G710 G90\nDEF INT AA=3.5\nG0 X=AA\nM30\n", "'AA', which holds whole numbers"},
      {"siemens_840d_sl", "G710 G90\nDEF INT AA\nAA=7/2\nG0 X=AA\nM30\n", "the control rounds it"},
      {"siemens_840d_sl", "G710 G90\nTRANS X5\nATRANS\nG0 X1\nM30\n", "'ATRANS' without an axis"},
      {"siemens_840d_sl", "G710 G90\nR1=1\nR1=2 R2=R1\nM30\n", "set and used in one line"},
      {"siemens_840d_sl", "G710 G90\nR1=2 G1 X5\nM30\n", "no variable"},
      {"siemens_840d_sl", "G710 G90\nG0 C400\nM30\n", "counts modulo one turn"},
      {"siemens_840d_sl", "G710 G90\nG91 SUPA G0 Z5\nM30\n", "under 'G91'"},
      {"siemens_840d_sl", "G710 G90\nSUPA G1 Z5 F100\nM30\n", "no rapid to a place of the machine"},
      {"siemens_840d_sl", "G710 G90\nG0 X1 Y0 Z0\nG3 X0 Y1 I-1 J0 CR=1 F100\nM30\n",
       "with its radius and its centre"},
      {"fanuc_30i", "G21 G90\n#2001=5.\nM30\n", "is the control's"},
      {"fanuc_30i", "G21 G90\n#3000=1\nM30\n", "is the control's"},
      {"haas_ngc", "G21 G90\n#3006=1\nM30\n", "is the control's"},
      {"fanuc_30i", "G21 G90\nG91 G10 L2 P1 X1. Y1. Z1.\nM30\n", "an offset that is set under 'G91'"},
      {"fanuc_30i", "G21 G90\nG10 L2 P0 X1. Y1. Z1.\nM30\n", "an offset of number 0"},
      {"fanuc_30i", "G21 G90\nG10 L2 P1 X1 Y1. Z1.\nM30\n", "{x} has no decimal point"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z50.\nG83 X1. Y1. Z1. R9. Q5000 F100.\nM30\n",
       "{step} has no decimal point"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z50.\nG82 X1. Y1. Z1. R9. P0.5 F100.\nM30\n",
       "controls differ in its unit"},
      {"fanuc_30i", "G21 G90\nG4 X500\nM30\n", "{seconds} has no decimal point"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG68.2 X0. Y0. Z0. I0. J30. K0.\nG1 X5. F100.\nM30\n",
       "without 'G53.1'"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG53.1\nM30\n", "no tilted plane is said"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG91 G53 Z0.\nM30\n", "'G53' under 'G91'"},
      {"fanuc_30i", "G20 G90\nG0 X0. Y0. Z0.\nG1 X5. F100\nM30\n", "F has no decimal point"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nF100.\nG20\nG1 X5.\nM30\n", "feed move without feed"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG2 X5. Y5. R5. I5. F100.\nM30\n",
       "with its radius and its centre"},
      {"linuxcnc", "G21 G90\nG0 X0 Y0 Z0\nG3 X0 Y1 I0 J0.5 P0 F100\nM2\n", "a number of turns"},
      {"haas_ngc", "G21 G90\nN7 G0 X0. Y0. Z0.\nM97 P7\nM30\nN7 G1 X5. F9.\nM99\n", "or more than one"},
      {"haas_ngc", "G21 G90\nG0 X0. Y0. Z0.\nG254\nG52 X1. Y1. Z1.\nM30\n", "in a tilted plane"},
      {"fanuc_30i", "G21 G90\nG0 X10. Y0. Z0.\nG2 X-10. Y0. I-5. I-10. F100.\nM30\n", "two I words"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z0.\nG28 X1. X2.\nM30\n", "two X words"},
      {"fanuc_30i", "G21 G90\nT1 T2 M6\nM30\n", "two T words"},
      {"siemens_840d_sl", "G710 G90\nTRANS X5 X7\nM30\n", "two X words"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 CYCL DEF 7.0 DATUM SHIFT\n2 CYCL DEF 7.1 X+5 X+7\n3 M2\n",
       "two X words"},
      // Heights of a cycle in other coordinates than it began in.
      {"fanuc_30i", "G21 G90 G54\nG0 X0. Y0. Z50.\nG81 X1. Y1. Z-5. R2. F100.\nG55\nX5. Y5.\nM30\n",
       "say it anew"},
      {"fanuc_30i",
       "G21 G90 G54\nG0 X0. Y0. Z50.\nG81 X1. Y1. Z-5. R2. F100.\nG10 L2 P1 X1. Y2. Z3.\nX5.\nM30\n",
       "say it anew"},
      {"fanuc_30i", "G21 G90 G54\nG0 X0. Y0. Z50.\nG81 X1. Y1. Z-5. R2. F100.\nG43 H2\nX5.\nM30\n",
       "say it anew"},
      {"fanuc_30i", "G21 G90 G54\nG0 X0. Y0. Z50.\nG81 X1. Y1. Z-5. R2. F100.\nG43.4 H1\nX5.\nM30\n",
       "say it anew"},
      // rs274: from R 2 to a clearance of 52, since R counts from where the tool is.
      {"linuxcnc", "G21 G90\nG0 X0 Y0 Z50\nG99 G81 X10 Y10 Z-5 R2 F100\nG91 X20\nG90 G80\nM2\n",
       "goes on in increments"},
      {"siemens_840d_sl", "G710 G90\nG0 X0 Y0 Z50\nF100\nG18\nCYCLE81(50,0,0,-10)\nM30\n",
       "setting data 42940"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z1.\nG98 G81 X1. Y1. Z-5. R2. F100.\nM30\n", "from below its R"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z1.\nG98 G81 Z-5. R2. F100.\nM30\n", "from below its R"},
      {"haas_ngc", "G21 G90\nG0 X0. Y0. Z9.\nG99 G81 X1. Y1. Z-5. R2. F100.\nG81 X2. Y1. Z-5. R3.\nM30\n",
       "from below its R"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z50.\nM29 S500\nG84 X1. Y1. Z-5. R2. F500.\nS1000\nX5.\nM30\n",
       "another speed under a tapping cycle"},
      {"fanuc_30i", "G20 G90\nG0 X0. Y0. Z9.\nG81 X1. Y1. Z-1. R1. F10\nM30\n", "F has no decimal point"},
      {"haas_ngc", "G21 G90\nG0 X0. Y0. Z9.\nG1 X5. F500\nM30\n", "F has no decimal point"},
      {"haas_ngc", "G21 G90\nG0 X0. Y0. Z9.\nG81 X1. Y1. Z-1. R1. F10\nM30\n", "F has no decimal point"},
      {"fanuc_30i", "O1\nG21 G90\nG0 X0. Y0. Z9.\nG1 X5. F100.\nO2\nX6.\nM30\n",
       "another program begins here"},
      {"fanuc_30i", "G21 G90\nG0 X0. Y0. Z9.\nG81 X1. Y1. Z-1. R1. F10.\nG81 F20.\nM30\n",
       "whether it drills here"},
      {"fanuc_30i", "G21 G90\nM98 P7 L0\nM30\nO7\nM99\n", "'L0'"},
      {"fanuc_30i", "%\nG21 G90\nG0 X0. Y0. Z0.\n% G1 X5. F100.\nM30\n%\n", "in the line of '%'"},
      {"fanuc_30i", "G21 G90\nG91 G52 X5. Y0. Z0.\nM30\n", "a shift under 'G91'"},
      {"fanuc_30i", "G21 G90\nT1 M6\nG43.4 H1\nG0 X0. Y0. Z50. A0. C0.\nT2 M6\nM30\n",
       "a tool change under tool-centre-point control"},
      {"siemens_840d_sl", "G710 G90\nCYCLE800(0,\"\",200000,57,0,0,0,30,0,0,0,0,0,0,0,1)\nM30\n",
       "direction 0"},
      {"siemens_840d_sl", "G710 G90\nTRAORI\nT2\nM6\nM30\n", "a tool change under tool-centre-point control"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 M128\n2 TOOL CALL 2 Z S100\n3 M2\n",
       "a tool change under tool-centre-point control"},
      {"heidenhain_tnc640",
       "0 BEGIN PGM P MM\n1 TRANS DATUM AXIS X+5 Y+0 Z+0\n2 CYCL DEF 7.0 DATUM SHIFT\n3 CYCL DEF 7.1 X+3\n4 "
       "M2\n",
       "another one of the program's own"},
      {"heidenhain_tnc640",
       "0 BEGIN PGM P MM\n1 TRANS DATUM AXIS X+5 Y+0 Z+0\n2 CYCL DEF 247 DATUM SETTING ~\nQ339=+2\n4 M2\n",
       "a preset, and the program's own shift"},
      {"heidenhain_tnc640",
       "0 BEGIN PGM P MM\n1 CYCL DEF 7.0 DATUM SHIFT\n2 CYCL DEF 7.1 X+3\n3 CYCL DEF 247 DATUM SETTING "
       "~\nQ339=+1\n4 "
       "M2\n",
       "another work offset"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 C X+0 Y+1 DR+ F100\n2 M2\n",
       "from a place that is not known"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 L X+1 Y+0 Z+0 R0 FMAX\n2 C X+0 Y+1 DR+ F100\n3 M2\n",
       "no pole"},
      {"heidenhain_tnc640",
       "0 BEGIN PGM P MM\n1 L X+1 Y+0 Z+0 R0 FMAX\n2 CC X+0 Y+0\n3 CP IPA-90 DR+ F100\n4 M2\n",
       "against its sense"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 L C+10 R0 FMAX\n2 L C+350 F100\n3 M2\n",
       "has not said which way"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 FN 9: IF +Q1 EQU +1 GOTO LBL 5\n2 M2\n",
       "'FN 9' is not read"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 L X+Q1 R0 FMAX\n2 M2\n", "Q1 has no value"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 CYCL DEF 7.0 DATUM SHIFT\n2 CYCL DEF 7.1 #5\n3 M2\n",
       "a datum shift"},
      {"heidenhain_tnc640",
       "0 BEGIN PGM P MM\n1 L X+1 Y+0 Z+0 FMAX\n2 CC X+0 Y+0\n3 C X+0 Y+1 DR+ DR- F100\n4 M2\n",
       "both senses"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 L X+1 Y+0 Z+0 FMAX\n2 CC X+0 Y+0\n3 LP PR+1 ; PA+90\n4 M2\n",
       "its radius and its angle"},
      {"heidenhain_tnc640",
       "0 BEGIN PGM P MM\n1 CC X+0 Y+0\n2 CYCL DEF 247 DATUM SETTING ~\nQ339=+2\n4 L X+1 Y+0 Z+0 FMAX\n5 C "
       "X+0 Y+1 DR+ "
       "F100\n6 M2\n",
       "no pole"},
      {"heidenhain_tnc640",
       "0 BEGIN PGM P MM\n1 CC X+0 Y+0\n2 TRANS DATUM AXIS X+5 Y+0 Z+0\n3 L X+1 Y+0 Z+0 FMAX\n4 C X+0 Y+1 "
       "DR+ "
       "F100\n5 M2\n",
       "no pole"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 L X+0 Y+0 Z+0 F9 F8\n2 M2\n", "two F words"},
      // "M128 becomes effective at the start of block, M129 at the end of block" (TNC 426/430, page 169).
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 M128\n2 L X+0 Y+0 Z+0 A+5 F9 M129\n3 M2\n",
       "from the end of its block"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 Q201 = -20\n2 M2\n", "Q201 is the control's"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 FN 0: Q203 = +9\n2 M2\n", "Q203 is the control's"},
      // In the order of the interpreter's own steps F comes before the unit.
      {"linuxcnc", "G21 G90\nG0 X0 Y0 Z0\nG20 F20\nG1 X1\nM2\n", "counts in the unit before"},
      {"linuxcnc", "G20 G90\nG0 X0 Y0 Z0\nG1 X1 F20\nG21 F200\nX2\nM2\n", "counts in the unit before"},
      {"linuxcnc", "G21 G90\nS1000 M3\nG0 X0 Y0 Z0\nG1 X1 F20\nS0\nX2\nM2\n", "at a speed of 0"},
      {"linuxcnc", "G21 G90\nS1000 M3\nG0 X0 Y0 Z0\nS0\nG2 X2 Y0 I1 J0 F90\nM2\n", "at a speed of 0"},
      {"fanuc_30i", "G21 G90\nS900 M3\nG0 X0. Y0. Z9.\nS0\nG81 X1. Y1. Z-1. R1. F9.\nM30\n",
       "at a speed of 0"},
      {"haas_ngc", "G21 G90\nS900 M3\nG0 X0. Y0. Z9.\nG81 X1. Y1. Z-1. R1. F9.\nS0\nX2.\nM30\n",
       "at a speed of 0"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 L X+1 Y+0 Z+0 FMAX\n2 L X+30 * Y+50 F100\n3 M2\n", "'*'"},
      {"heidenhain_tnc640", "0 BEGIN PGM P MM\n1 Q1 = 5\n2 L X+Q1*2 FMAX\n3 M2\n", "'*' is not"},
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

// Spindle, tools and motions in the order in which they act: "S800 T7 cut S0".
std::string order_of(const std::string& text, const std::string& control) {
  std::string out;
  for (const Block& block : read(text, control)) {
    std::string word;
    if (const auto* spindle = std::get_if<Spindle>(&block))
      word = "S" + std::to_string(spindle->turn == SpindleTurn::off ? 0 : spindle->rpm);
    else if (const auto* call = std::get_if<ToolCall>(&block))
      word = "T" + std::to_string(call->tool);
    else if (const auto* coolant = std::get_if<Coolant>(&block))
      word = coolant->kind == CoolantKind::off ? "dry" : "wet";
    else if (const auto* motion = std::get_if<Motion>(&block))
      word = motion->kind == MotionKind::feed ? "cut" : "rapid";
    if (!word.empty()) out += (out.empty() ? "" : " ") + word;
  }
  return out;
}

TEST(OtherWords, ASpeedBesideAToolChangeIsThatOfTheNewTool) {
  const std::string head = "BEGIN PGM A MM\nTOOL CALL 4 Z S800\nM3\nL X+0 Y+0 Z+50 R0 FMAX\n";
  const std::string end = "L Z+50 FMAX\nM30\nEND PGM A MM\n";
  EXPECT_EQ(order_of(head + "TOOL CALL 7 Z S18000\nM3\n" + end, "heidenhain_tnc640"),
            "T4 S800 rapid T7 S18000 rapid");
  EXPECT_EQ(order_of(head + "TOOL CALL 7 Z S18000\n" + end, "heidenhain_tnc640"), "T4 S800 rapid T7 rapid");
  EXPECT_EQ(order_of("G21 G90\nT4 M6\nS800 M3\nG0 X0 Y0\nS2000 T7 M6\nM3\nG0 X1\nM30\n", "linuxcnc"),
            "T4 S800 rapid T7 S2000 rapid");
  EXPECT_EQ(order_of("G21 G90\nT4 M6\nS800 M3\nG0 X0 Y0\nS2000 T7 M6 M3\nG0 X1\nM30\n", "linuxcnc"),
            "T4 S800 rapid T7 S2000 rapid");
}

TEST(OtherWords, ASpeedAloneChangesThatOfTheSpindleThatTurns) {
  const std::string head = "BEGIN PGM A MM\nTOOL CALL 4 Z S800\nM3\nL X+0 Y+0 Z+50 R0 FMAX\n";
  const std::string end = "L X+20 F100\nM30\nEND PGM A MM\n";
  EXPECT_EQ(order_of(head + "TOOL CALL Z S3000\n" + end, "heidenhain_tnc640"), "T4 S800 rapid S3000 cut");
  EXPECT_EQ(order_of(head + "TOOL CALL Z S3000\nM3\n" + end, "heidenhain_tnc640"), "T4 S800 rapid S3000 cut");
  EXPECT_EQ(order_of(head + "TOOL CALL Z S800\n" + end, "heidenhain_tnc640"), "T4 S800 rapid cut");
  EXPECT_EQ(order_of(head + "M5\nTOOL CALL Z S3000\nM3\n" + end, "heidenhain_tnc640"),
            "T4 S800 rapid S0 S3000 cut");
}

TEST(OtherWords, WhatEndsInTheBlockOfAMotionDoesSoBehindIt) {
  const std::string klartext =
      "BEGIN PGM A MM\nTOOL CALL 4 Z S800\nM3\nM8\nL X+0 Y+0 Z+50 R0 FMAX\nL X+10 F100 M9\nL X+20 M5\n"
      "M30\nEND PGM A MM\n";
  EXPECT_EQ(order_of(klartext, "heidenhain_tnc640"), "T4 S800 wet rapid cut dry cut S0");
  const std::string iso =
      "G21 G90 G54\nT4 M6\nS800 M3\nM8\nG0 X0. Y0. Z50.\nG1 X10. F100. M9\nX20. M5\nG3 X30. Y10. R10. "
      "M3\nM30\n";
  EXPECT_EQ(order_of(iso, "haas_ngc"), "T4 S800 wet rapid cut dry cut S0 S800");
  // LinuxCNC stops first: its order of execution.
  EXPECT_EQ(order_of(iso, "linuxcnc"), "T4 S800 wet rapid dry cut S0 cut S800");
}

}  // namespace
}  // namespace trunnion::nc
