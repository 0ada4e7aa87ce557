#include "trunnion/thermal/log.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/base/number_text.hpp"

#include "thermal/day_log.hpp"

namespace trunnion::thermal {
namespace {

TEST(ThermalLog, KeepsRatesApartAndReadsUnits) {
  Diagnostics diagnostics;
  const auto log = parse_log(
      "# a comment\nrun_id,time_s,T_front_degC,feed_mm_min,dx_um\nday1,0,20.5,600,\nday1,1, 20.6 "
      ",600,12.5\nday2,0,21,0,\n",
      "log.csv", diagnostics);
  ASSERT_TRUE(log) << log.error().text();
  ASSERT_EQ(log->runs.size(), 2U);
  EXPECT_EQ(log->runs[0].id, "day1");
  EXPECT_DOUBLE_EQ(log->runs[0].temperature_degC[0][1], 20.6);
  EXPECT_DOUBLE_EQ(log->runs[0].feed_mm_s[0], 10.0);
  EXPECT_TRUE(std::isnan(log->runs[0].channel_mm[0][0]));
  EXPECT_DOUBLE_EQ(log->runs[0].channel_mm[0][1], 0.0125);
}

TEST(ThermalLog, SaysWhereALogIsWrong) {
  const auto message = [](const char* text) {
    Diagnostics diagnostics;
    const auto log = parse_log(text, "log.csv", diagnostics);
    return log ? std::string("no error") : log.error().text();
  };
  EXPECT_EQ(message("time_s,front\n0,1\n"),
            "log.csv:1:2: error: column 'front' is none of run_id, time_s, T_<name>_degC, spindle_rpm, "
            "feed_mm_min, <channel>_um");
  EXPECT_EQ(message("time_s,dx_um\n0,1\n0,2\n"),
            "log.csv:3:1: error: time 0 s of run '1' does not come after 0 s");
  EXPECT_EQ(message("time_s,dx_um\n0,abc\n"), "log.csv:2:2: error: 'abc' in column 'dx_um' is not a number");
  EXPECT_EQ(message("T_a_degC\n1\n"), "log.csv:1:1: error: no column 'time_s'");
  EXPECT_EQ(message(""), "log.csv:1:1: error: no header line: the file is empty");
  EXPECT_EQ(message("time_s\n"), "log.csv:1:1: error: the log has no rows");
}

TEST(ThermalLog, TextReadsBack) {
  Diagnostics diagnostics;
  const char* text = "run_id,time_s,T_a_degC,spindle_rpm,dx_um\nd,0,20.125,1000,\nd,0.5,,0,-3.25\n";
  const auto log = parse_log(text, "log.csv", diagnostics);
  ASSERT_TRUE(log);
  const auto again = parse_log(log_text(*log, {" made by a test"}), "again.csv", diagnostics);
  ASSERT_TRUE(again);
  EXPECT_DOUBLE_EQ(again->runs[0].temperature_degC[0][0], 20.125);
  EXPECT_TRUE(std::isnan(again->runs[0].temperature_degC[0][1]));
  EXPECT_DOUBLE_EQ(again->runs[0].channel_mm[0][1], -0.00325);
}

// 24 h at 30 Hz with eight sensors: 2.6 million rows, 23 million fields. How long that takes is a benchmark
// (tests/bench), because a test that looks at the clock fails on a slow machine.
TEST(LongThermalLog, ADayAt30HzIsRead) {
  Diagnostics diagnostics;
  const auto log = parse_log(test::day_log_text(), "day.csv", diagnostics);
  ASSERT_TRUE(log);
  EXPECT_EQ(log->runs[0].rows(), test::kDayRows);
  EXPECT_DOUBLE_EQ(log->runs[0].temperature_degC[7][12345], test::day_degC(12345, 7));
}

}  // namespace
}  // namespace trunnion::thermal
