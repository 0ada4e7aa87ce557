// Arcs and drilling cycles: what goes out in each control's words, and what the reader refuses.
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <unistd.h>

#include "trunnion/nc/expand.hpp"

#include "support/controllers.hpp"

namespace trunnion {
namespace {

using nc::AxisLetter;
using ::testing::HasSubstr;

nc::AxisWords at(std::int64_t x, std::int64_t y, std::int64_t z) {
  nc::AxisWords words;
  words.set(AxisLetter::X, x);
  words.set(AxisLetter::Y, y);
  words.set(AxisLetter::Z, z);
  return words;
}

/// From (10, 0, 50) a quarter of a circle about the origin to (0, 10), and back by a helix; two holes with
/// pecks at (5, 5) and (25, 5), the tool returning to Z 50.
std::vector<nc::Block> part(const nc::Controller& c) {
  const std::int64_t mm = c.numbers.axes.quanta(AxisLetter::X, 1.0);
  const std::int64_t feed = c.numbers.feed.quanta(nc::FeedMode::per_minute, 5.0);  // 300 mm/min
  std::vector<nc::Block> out = {nc::ProgramStart{}};
  nc::Motion start;
  start.words = at(10 * mm, 0, 50 * mm);
  out.emplace_back(start);
  nc::Arc arc;
  arc.words = at(0, 10 * mm, 50 * mm);
  arc.feed = feed;
  out.emplace_back(arc);
  if (!c.arcs.helix_clockwise.empty()) {
    arc.clockwise = true;
    arc.words = at(10 * mm, 0, 51 * mm);
    out.emplace_back(arc);
  }
  start.words = at(5 * mm, 5 * mm, 50 * mm);
  out.emplace_back(start);
  nc::Hole hole;
  hole.kind = nc::Hole::Kind::peck;
  hole.feed = feed;
  hole.bottom = -12 * mm;
  hole.clear = 3 * mm;
  hole.step = 6 * mm;
  hole.words = at(5 * mm, 5 * mm, 50 * mm);
  out.emplace_back(hole);
  start.words = at(25 * mm, 5 * mm, 50 * mm);
  if (!c.cycles.modal()) out.emplace_back(start);
  hole.words = start.words;
  out.emplace_back(hole);
  out.emplace_back(nc::ProgramEnd{});
  return out;
}

// As the manuals of the controls have them.
TEST(Shapes, StandInEachControlsWords) {
  const auto text = [](const char* name) {
    const auto c = test::shipped_controller(name);
    return test::nc_text(c, part(c));
  };
  EXPECT_THAT(text("linuxcnc"), HasSubstr("G3 X0.0000 Y10.0000 I-10.0000 J0.0000 F300.000\n"
                                          "G2 X10.0000 Y0.0000 Z51.0000 I0.0000 J-10.0000\n"
                                          "G0 X5.0000 Y5.0000 Z50.0000\n"
                                          "G98 G83 X5.0000 Y5.0000 Z-12.0000 R3.0000 Q6.0000 F300.000\n"
                                          "X25.0000\nG80\n"));
  EXPECT_THAT(text("fanuc_30i"), HasSubstr("G3 X0. Y10. I-10. J0. F300."));
  EXPECT_THAT(text("fanuc_30i"), HasSubstr("G98 G83 X5. Y5. Z-12. R3. Q6. F300."));
  EXPECT_THAT(text("haas_ngc"), HasSubstr("G2 X10. Y0. Z51. I0. J-10."));
  EXPECT_THAT(text("siemens_840d_sl"), HasSubstr("CYCLE83(50,3,0,-12,,,6,0,0,0,1,1)"));
  EXPECT_THAT(text("heidenhain_tnc640"), HasSubstr(" CC X+0 Y+0\n"));
  EXPECT_THAT(text("heidenhain_tnc640"), HasSubstr(" C X+0 Y+10 DR+ F300\n"));
  EXPECT_THAT(text("heidenhain_tnc640"),
              HasSubstr("CYCL DEF 200 DRILLING ~\nQ200=+0 ~\nQ201=-15 ~\nQ206=300 ~\nQ202=6 ~\n"
                        "Q210=+0 ~\nQ203=+3 ~\nQ204=+47 ~\nQ211=0\n"));
}

TEST(Shapes, AHoleIsDrilledAsTheControlDoes) {
  const auto c = test::shipped_controller("linuxcnc");
  nc::Hole hole;
  hole.kind = nc::Hole::Kind::peck;
  hole.from = at(0, 0, 500000);
  hole.words = at(10000, 0, 500000);
  hole.clear = 20000;
  hole.bottom = -50000;
  hole.step = 30000;
  std::string text;
  for (const nc::Stroke& s : nc::strokes_of(hole, c.cycles, c.numbers.axes)) {
    char buffer[64];
    std::snprintf(buffer, sizeof buffer, "%s %.3f %.3f\n", s.rapid ? "rapid" : "feed", s.xyz_mm[0],
                  s.xyz_mm[2]);
    text += buffer;
  }
  // R2 Q3 to Z-5: by hand from its manual, rapids down to 0.254 above the last bottom.
  EXPECT_EQ(
      text,
      "rapid 1.000 50.000\nrapid 1.000 2.000\nfeed 1.000 -1.000\nrapid 1.000 2.000\nrapid 1.000 -0.746\n"
      "feed 1.000 -4.000\nrapid 1.000 2.000\nrapid 1.000 -3.746\nfeed 1.000 -5.000\nrapid 1.000 50.000\n");
}

// Places of an arc lie on it, and the way between two of them within what the course says.
TEST(Shapes, TheCourseOfAnArcHoldsIt) {
  const nc::AxisFormat format(4, 4);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (int i = 0; i < 300; ++i) {
    const double radius = 0.5 + 100.0 * u(random);
    const double start = 6.0 * u(random);
    const double sweep = 0.05 + 6.1 * u(random);
    nc::Arc arc;
    arc.clockwise = u(random) < 0.5;
    const double sense = arc.clockwise ? -1.0 : 1.0;
    const auto place = [&](double t) {
      const double angle = start + sense * t * sweep;
      return std::array<double, 2>{radius * std::cos(angle), radius * std::sin(angle)};
    };
    const auto words = [&](double t) {
      return at(std::llround(1e4 * place(t)[0]), std::llround(1e4 * place(t)[1]), 0);
    };
    arc.from = words(0.0);
    arc.words = words(1.0);
    const auto course = nc::course_of(arc, format, 0.002);
    EXPECT_NEAR(course.sweep_rad, sweep, 3e-4 / radius);
    EXPECT_LE(course.off_chord_mm, 0.002 + 3e-4);
    std::array<double, 3> before{place(0.0)[0], place(0.0)[1], 0.0};
    double bow = 0.0;
    for (const auto& p : course.xyz_mm) {
      EXPECT_NEAR(std::hypot(p[0], p[1]), radius, 3e-4);
      bow = std::max(bow, radius - std::hypot(0.5 * (before[0] + p[0]), 0.5 * (before[1] + p[1])));
      before = p;
    }
    EXPECT_LE(bow, course.off_chord_mm + 2e-4);
    EXPECT_GE(course.off_chord_mm, bow - 2e-4);
    const auto half = course.xyz_mm[(course.xyz_mm.size() - 1) / 2];
    const double t =
        static_cast<double>((course.xyz_mm.size() - 1) / 2 + 1) / static_cast<double>(course.xyz_mm.size());
    EXPECT_NEAR(half[0], place(t)[0], 5e-4);
    EXPECT_NEAR(half[1], place(t)[1], 5e-4);
  }
}

std::string first_error(const std::string& text, const std::string& control = "linuxcnc") {
  const auto controller = test::shipped_controller(control);
  Diagnostics diagnostics;
  const auto blocks = nc::read_program(controller, text, "p.nc", diagnostics);
  return blocks ? "read" : diagnostics.findings().front().text();
}

TEST(Shapes, WhatCannotBeReadIsRefusedByWordAndPlace) {
  const std::string start = "G0 X10 Y0 Z5\n";
  EXPECT_EQ(first_error(start + "G1 X10 F100\nG3 X0 Y10 I-10 J0\nM2"), "read");
  EXPECT_EQ(first_error("G1 X1 F100\nG3 X0 Y10 I-10 J0\nM2"),
            "p.nc:2:16: error: an arc from a place that is not known");
  EXPECT_EQ(first_error(start + "G3 X0 Y10 I-10 J0\nM2"), "p.nc:2:16: error: an arc without feed");
  EXPECT_EQ(first_error(start + "G3 X0 Y10.1 I-10 J0 F100\nM2"),
            "p.nc:2:18: error: an arc whose radius to the start is 10.000000 mm and to the end 10.100000 mm");
  EXPECT_EQ(first_error(start + "G3 X10 Y0 I0 J0 F100\nM2"),
            "p.nc:2:14: error: an arc whose radius to the start is 0.000000 mm and to the end 0.000000 mm");
  EXPECT_EQ(first_error(start + "G93 G1 X9 F2\nG3 X0 Y9 I-9 J0 F2\nM2"),
            "p.nc:3:14: error: an arc under inverse time is not read");
  EXPECT_EQ(first_error(start + "G3 X0 Y10 R10 F100\nM2"),
            "p.nc:2:1: error: G3: an arc is read as G3 X Y I J, with Z for a helix");
  EXPECT_EQ(first_error(start + "G90.1\nM2"),
            "p.nc:2:1: error: G90.1: centres of arcs are read as distances from the start (G91.1)");
  // No motion word behind an arc: a control would go on with arcs.
  EXPECT_EQ(first_error(start + "G3 X0 Y10 I-10 J0 F100\nX5\nM2"),
            "p.nc:3:1: error: axis words before any G0 or G1");
  EXPECT_EQ(first_error(start + "G3 X0 Y10 I-10 J0 A5 F100\nM2"),
            "p.nc:2:19: error: axis words stand in one block with words that exclude motion");

  const std::string hole = start + "G98 G81 X1 Y2 Z-5 R2 F100\n";
  EXPECT_EQ(first_error(hole + "X3\nG80\nM2"), "read");
  EXPECT_EQ(
      first_error(hole + "X3 Z-6\nG80\nM2"),
      "p.nc:3:1: error: under a drilling cycle X and Y may follow; all other words with the cycle's own");
  EXPECT_EQ(
      first_error(hole + "X3 A5\nG80\nM2"),
      "p.nc:3:1: error: under a drilling cycle X and Y may follow; all other words with the cycle's own");
  EXPECT_EQ(first_error(start + "G98 G81 X1 Y2 Z5 R2 F100\nM2"),
            "p.nc:2:21: error: a drilling cycle whose bottom is not below its clearance");
  EXPECT_EQ(first_error(start + "G98 G83 X1 Y2 Z-5 R2 Q0 F100\nM2"),
            "p.nc:2:25: error: a drilling cycle with a step of nothing");
  EXPECT_EQ(first_error(start + "G98 G83 X1 Y2 Z-5 R2 Q-1 F100\nM2"),
            "p.nc:2:26: error: a drilling cycle with a step below 0");
  EXPECT_NE(first_error(start + "G98 G83 X1 Y2 Z-9999 R2 Q0.001 F100\nM2").find("more than 10000 steps"),
            std::string::npos);
  EXPECT_EQ(first_error(start + "G98 G81 X1 Y2 Z-5 R2 F0\nM2"),
            "p.nc:2:22: error: a drilling cycle without feed");
  EXPECT_EQ(first_error("G0 X1 Y1\nG98 G81 X1 Y2 Z-5 R2 F100\nM2"),
            "p.nc:2:22: error: a drilling cycle from a place that is not known");
  EXPECT_EQ(first_error("G0 X1 Y1 Z60\nG1 F100\nCYCLE81(1,3,0,-12)\nM30", "siemens_840d_sl"),
            "p.nc:3:1: error: a drilling cycle that returns below its clearance");
}

std::string finding_of(const std::string& toml) {
  const std::string path = ::testing::TempDir() + "trunnion_shapes_" + std::to_string(getpid()) + ".toml";
  std::FILE* file = std::fopen(path.c_str(), "w");
  std::fputs(("[controller]\nname = \"T\"\nbase = \"iso\"\n" + toml).c_str(), file);
  std::fclose(file);
  Diagnostics diagnostics;
  const auto c = nc::load_controller(path, diagnostics, test::controller_folder());
  return c ? "read" : diagnostics.findings().front().message;
}

TEST(Shapes, AControllerFileWithHalfOfTheirWordsIsRefused) {
  EXPECT_EQ(finding_of("[arcs]\nclockwise = \"G2 X{x} Y{y} I{i} J{j}\"\nradius_tolerance_mm = 0.01\n"),
            "'clockwise' and 'counterclockwise' go together");
  EXPECT_EQ(
      finding_of(
          "[arcs]\nclockwise = \"G2 X{x} Y{y} I{i} J{j}\"\ncounterclockwise = \"G3 X{x} Y{y} I{i} J{j}\"\n"),
      "'radius_tolerance_mm' must be above 0");
  EXPECT_EQ(finding_of("[cycles]\ndrill = \"G81 X{x} Y{y} Z{bottom} F{feed}\"\n"),
            "'drill' needs {clear}, and {bottom} or {depth}");
  EXPECT_EQ(finding_of("[cycles]\npeck = \"G83 X{x} Y{y} Z{bottom} R{clear} Q{step} F{feed}\"\n"),
            "'back_mm' must be above 0 for cycles with steps");
  EXPECT_EQ(finding_of("[cycles]\ndrill = \"G81 X{x} Y{y} Z{bottom} R{clear} F{feed}\"\nto_clear = []\n"),
            "[cycles] 'off' needs 'to_clear' and 'to_initial' too");
  EXPECT_EQ(finding_of("[cycles]\ntap = \"G84 X{x} Y{y} Z{bottom} R{clear}\"\n"),
            "'tap' needs {bottom} or {depth}, and one of {feed}, {pitch} and {lead}");
  EXPECT_EQ(finding_of("[cycles]\ntap = []\n"), "'tap_left' needs 'tap' too");
  EXPECT_EQ(finding_of("[post]\narcs = \"sometimes\"\n"),
            "'arcs' must be one of \"native\", \"moves\", not \"sometimes\"");
}

TEST(Arcs, ACentreFarBeyondAnyMachineIsRefused) {
  const auto controller = test::shipped_controller("linuxcnc");
  Diagnostics diagnostics;
  EXPECT_FALSE(nc::read_program(controller, "G0 X0 Y0 Z0\nG1 Z-1 F100\nG3 X0 Y0 I0 J-900000000000\nM2\n",
                                "p.nc", diagnostics));
  ASSERT_FALSE(diagnostics.findings().empty());
  EXPECT_NE(
      diagnostics.findings().front().text().find("an arc whose centre is -900000000000.000000 mm away in Y"),
      std::string::npos)
      << diagnostics.findings().front().text();
}

}  // namespace
}  // namespace trunnion
