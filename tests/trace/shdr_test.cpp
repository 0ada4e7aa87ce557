#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/trace/trace.hpp"

#include "support/machines.hpp"

namespace trunnion::trace {
namespace {

using ::testing::HasSubstr;

ShdrImport items() {
  return {{{"Xact", "X_mm"},
           {"Yact", "Y_mm"},
           {"Zact", "Z_mm"},
           {"Aact", "A_deg"},
           {"Cact", "C_deg"},
           {"line", "block"}}};
}

std::string stamp(double s) {
  char text[64];
  std::snprintf(text, sizeof text, "2026-11-26T23:59:%02d.%06d", static_cast<int>(s),
                static_cast<int>(std::lround((s - std::floor(s)) * 1e6)));
  return text;
}

Result<Trace> read(const std::string& text) {
  Diagnostics diagnostics;
  return parse_shdr(text, "s.txt", test::shipped_machine("trunnion_offset"), items(), diagnostics);
}

std::string message(const std::string& text) {
  const auto trace = read(text);
  return trace ? std::string("taken") : trace.error().text();
}

std::string start(double s) {
  return stamp(s) + "Z|avail|AVAILABLE|Xact|0|Yact|5|Zact|7|Aact|90|Cact|-180|line|12\n";
}

TEST(Shdr, TakesKeysAndValuesInAnyOrder) {
  std::string text = "* adapterVersion: 2.1\n" + start(10.0);
  for (int i = 1; i < 20; ++i) {
    text += stamp(10.0 + 0.05 * i) + "Z|execution|ACTIVE|mill:Xact|" + std::to_string(i) + "\r\n";
    if (i == 8) text += stamp(10.42) + "Z@0.1|line|13\n";
    text += stamp(10.0 + 0.05 * i) + "Z|system|FAULT|31|1|LOW|Xact too hot\n";
  }
  const auto trace = read(text);
  ASSERT_TRUE(trace) << trace.error().text();
  ASSERT_EQ(trace->samples.size(), 20U);
  EXPECT_EQ(trace->samples[0].time_s, 0.0);
  EXPECT_NEAR(trace->samples[4].time_s, 0.2, 1e-6);
  EXPECT_EQ(trace->samples[4].q[0], 4.0);
  EXPECT_EQ(trace->samples[19].q[1], 5.0);
  EXPECT_NEAR(trace->samples[19].q[3], kPi / 2, 1e-15);
  EXPECT_EQ(trace->samples[8].nc_line, 12U);
  EXPECT_EQ(trace->samples[9].nc_line, 13U);
}

TEST(Shdr, KnowsDatesAndClocks) {
  const auto first_two = [](const std::string& a, const std::string& b) {
    std::string text = a + "|Xact|0|Yact|5|Zact|7|Aact|90|Cact|-180|line|1\n";
    text += b + "|Xact|1\n";
    for (int i = 1; i < 12; ++i)
      text += "2027-01-01T00:00:" + std::to_string(10 + i) + "|Yact|" + std::to_string(i) + "\n";
    const auto trace = read(text);
    return trace ? trace->samples[1].time_s : NAN;
  };
  EXPECT_NEAR(first_two("2026-12-31T23:59:59.5Z", "2027-01-01T00:00:00.25"), 0.75, 1e-6);
  EXPECT_NEAR(first_two("2024-02-28T23:59:59Z", "2024-03-01T00:00:00Z"), 86401.0, 1e-6);
  EXPECT_NEAR(first_two("2026-11-26T10:00:00+01:00", "2026-11-26T09:00:02Z"), 2.0, 1e-6);
  EXPECT_NEAR(first_two("2026-11-26T04:30:00-04:30", "2026-11-26T09:00:02Z"), 2.0, 1e-6);
  // Milliseconds of a clock of its own.
  std::string text = "1000|Xact|0|Yact|5|Zact|7|Aact|90|Cact|-180|line|1\n";
  for (int i = 1; i < 12; ++i) text += std::to_string(1000 + 4 * i) + ".5|Xact|" + std::to_string(i) + "\n";
  const auto trace = read(text);
  ASSERT_TRUE(trace) << trace.error().text();
  EXPECT_NEAR(trace->samples[1].time_s, 0.0045, 1e-9);
}

// An axis that rests says nothing: it does not creep to its next value.
TEST(Shdr, AnAxisThatSaysNothingStandsStill) {
  std::string text = start(0.0);
  for (int i = 1; i <= 400; ++i) {
    const double s = 0.01 * i;
    text += stamp(s) + "|Yact|" + std::to_string(0.1 * i) + "\n";
    if (i <= 100) text += stamp(s) + "|Xact|" + std::to_string(0.2 * i) + "\n";
    if (i >= 300) text += stamp(s) + "|Xact|" + std::to_string(20.0 + 0.2 * (i - 299)) + "\n";
  }
  const auto trace = read(text);
  ASSERT_TRUE(trace) << trace.error().text();
  for (const Sample& sample : trace->samples) {
    const double i = sample.time_s / 0.01;
    const double x = i <= 100.0 ? 0.2 * i : i <= 299.0 ? 20.0 : 20.0 + 0.2 * (i - 299.0);
    EXPECT_NEAR(sample.q[0], x, 1e-4) << sample.time_s;
  }
}

TEST(Shdr, ValuesOfDifferentMomentsAreBroughtTogether) {
  std::mt19937_64 random(28);
  std::uniform_real_distribution<double> step(0.004, 0.02);
  const std::array<const char*, 5> keys = {"Xact", "Yact", "Zact", "Aact", "Cact"};
  const auto at = [](std::size_t axis, double s) {
    return (1.0 + static_cast<double>(axis)) * 10.0 * std::sin(0.7 * s + static_cast<double>(axis));
  };
  std::vector<std::pair<double, std::string>> lines;
  for (std::size_t axis = 0; axis < 5; ++axis) {
    for (double s = 0.001; s < 30.0; s += step(random)) {
      const double told = std::round(s * 1e6) * 1e-6;
      char value[32];
      std::snprintf(value, sizeof value, "%.7f", at(axis, told));
      lines.emplace_back(told, stamp(told) + "|" + keys[axis] + "|" + value + "\n");
    }
  }
  std::sort(lines.begin(), lines.end());
  std::string text = stamp(0.0) + "|line|4\n";
  for (const auto& [s, line] : lines) text += line;
  const auto trace = read(text);
  ASSERT_TRUE(trace) << trace.error().text();
  EXPECT_GT(trace->samples.size(), 10000U);
  const double first = lines.front().first;
  double worst = 0.0;
  for (const Sample& sample : trace->samples) {
    for (std::size_t axis = 0; axis < 5; ++axis) {
      const double unit = axis < 3 ? 1.0 : kRadPerDegree;
      worst = std::max(worst, std::abs(sample.q[axis] / unit - at(axis, sample.time_s + first)));
    }
  }
  // A chord of a sine over a step h: amplitude (0.7 h)^2 / 8; a step longer than 1.5 usual ones is a rest.
  EXPECT_LT(worst, 50.0 * 0.7 * 0.02);
  EXPECT_GT(worst, 0.0);
}

TEST(Shdr, WhatIsNotAvailableIsLeftOut) {
  std::string text = start(0.0);
  for (int i = 1; i <= 40; ++i) {
    text += stamp(0.01 * i) + "|Xact|" + (i == 20 ? std::string("UNAVAILABLE") : std::to_string(i)) + "\n";
    text += stamp(0.01 * i) + "|Yact|" + std::to_string(2 * i) + "\n";
  }
  Diagnostics diagnostics;
  const auto trace =
      parse_shdr(text, "s.txt", test::shipped_machine("trunnion_offset"), items(), diagnostics);
  ASSERT_TRUE(trace) << trace.error().text();
  EXPECT_EQ(trace->samples.size(), 40U);
  EXPECT_EQ(trace->incomplete, 1U);
  ASSERT_EQ(diagnostics.findings().size(), 1U);
  EXPECT_THAT(diagnostics.findings()[0].message, HasSubstr("1 of 41 rows"));
}

TEST(Shdr, SaysWhatIsWrongAndWhere) {
  EXPECT_THAT(message(""), HasSubstr("no line gives the item 'Xact'"));
  EXPECT_THAT(message(stamp(1) + "|Xabs|1|Yabs|2\n"), HasSubstr("others that it gives: Xabs, Yabs"));
  EXPECT_THAT(
      message(start(1) + "Xact|4\n"),
      HasSubstr("s.txt:2:1: error: a line of an adapter is time|item|value..., this begins with 'Xact'"));
  EXPECT_THAT(message(start(1) + "2026-13-01T00:00:00|Xact|4\n"), HasSubstr("is no time"));
  EXPECT_THAT(message(start(1) + stamp(2) + "|Xact|four\n"), HasSubstr("s.txt:2:1: error: 'four'"));
  EXPECT_THAT(message(start(2) + stamp(1.5) + "|Xact|4\n"), HasSubstr("'Xact' goes back, by 0.5 s"));
  EXPECT_THAT(message(start(1) + stamp(2) + "|Xact|4\n"), HasSubstr("2 complete rows"));
  ShdrImport how = items();
  how.items.pop_back();
  how.items.back().column = "C_rad";
  Diagnostics diagnostics;
  const auto trace = parse_shdr("", "s.txt", test::shipped_machine("trunnion_offset"), how, diagnostics);
  ASSERT_FALSE(trace);
  EXPECT_THAT(trace.error().text(), HasSubstr("nobody knows the column 'C_rad' of the item 'Cact'"));
}

// Axes that are sent at moments of their own: how far apart is in the file that comes out, and read again.
TEST(Shdr, SaysHowFarApartTheValuesOfAnAxisAre) {
  std::string apart = start(10.0), together = start(10.0);
  const std::array<const char*, 5> keys = {"Xact", "Yact", "Zact", "Aact", "Cact"};
  for (int i = 1; i < 40; ++i) {
    together += stamp(10.0 + 0.05 * i) + "Z";
    for (int axis = 0; axis < 5; ++axis) {
      const std::string value =
          "|" + std::string(keys[static_cast<std::size_t>(axis)]) + "|" + std::to_string(i + axis);
      apart += stamp(10.0 + 0.05 * i + 0.01 * axis) + "Z" + value + "\n";
      together += value;
    }
    together += "\n";
  }
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto trace = read(apart), at_once = read(together);
  ASSERT_TRUE(trace) << trace.error().text();
  ASSERT_TRUE(at_once) << at_once.error().text();
  EXPECT_NEAR(trace->apart_s, 0.05, 1e-6);
  EXPECT_EQ(at_once->apart_s, 0.0);
  Diagnostics diagnostics;
  const auto again = parse_trace(trace_text(*trace, machine), "t.csv", machine, diagnostics);
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(again->apart_s, trace->apart_s);
  for (const char* said : {"soon s", "20 ms", "0.05", "-1 s", "inf s"}) {
    std::string wrong = trace_text(*trace, machine);
    wrong.replace(wrong.find("0.05 s"), 6, said);
    const auto refused = parse_trace(wrong, "t.csv", machine, diagnostics);
    ASSERT_FALSE(refused) << said;
    EXPECT_THAT(refused.error().text(), HasSubstr("values are apart by seconds"));
  }
}

}  // namespace
}  // namespace trunnion::trace
