#include "trunnion/trace/trace.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/machines.hpp"

namespace trunnion::trace {
namespace {

using ::testing::HasSubstr;

const char* const kHead = "# a comment\ntime_s,X_mm,Y_mm,Z_mm,A_deg,C_deg\n";

std::string rows(int count) {
  std::string out;
  for (int i = 0; i < count; ++i) out += std::to_string(i) + "e-3,1,2,3,90,-180\n";
  return out;
}

TEST(TraceFile, TakesUnitsFromTheNames) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  Diagnostics diagnostics;
  const auto trace = parse_trace(kHead + rows(12), "t.csv", machine, diagnostics);
  ASSERT_TRUE(trace) << trace.error().text();
  ASSERT_EQ(trace->samples.size(), 12U);
  EXPECT_DOUBLE_EQ(trace->samples[3].time_s, 0.003);
  EXPECT_DOUBLE_EQ(trace->samples[3].q[2], 3.0);
  EXPECT_NEAR(trace->samples[3].q[3], kPi / 2, 1e-15);
  EXPECT_NEAR(trace->samples[3].q[4], -kPi, 1e-15);
  EXPECT_EQ(trace->positions, Positions::joints);
}

TEST(TraceFile, ReadsBackWhatItWrites) {
  const Machine machine = test::shipped_machine("nutating_45");
  Trace trace;
  trace.has_blocks = true;
  trace.positions = Positions::words;
  for (int i = 0; i < 20; ++i) {
    Sample sample;
    sample.time_s = 0.25 * i;
    for (AxisId id = 0; id < machine.axes.size(); ++id) sample.q[id] = 0.1 * i + static_cast<double>(id);
    sample.nc_line = static_cast<std::uint32_t>(i);
    trace.samples.push_back(sample);
  }
  Diagnostics diagnostics;
  const auto again = parse_trace(trace_text(trace, machine, {"from nobody"}), "t.csv", machine, diagnostics);
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(again->positions, Positions::words);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(again->samples[i].nc_line, trace.samples[i].nc_line);
    for (AxisId id = 0; id < machine.axes.size(); ++id)
      EXPECT_NEAR(again->samples[i].q[id], trace.samples[i].q[id], 1e-6);
  }
}

TEST(TraceFile, SaysWhatIsWrongAndWhere) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto message = [&](const std::string& text) {
    Diagnostics diagnostics;
    const auto trace = parse_trace(text, "t.csv", machine, diagnostics);
    return trace ? std::string("taken") : trace.error().text();
  };
  EXPECT_THAT(message("time_s,X_mm,Y_mm,Z_mm,A_deg\n" + rows(0)), HasSubstr("missing: C_deg"));
  EXPECT_THAT(message("time_s,X_in,Y_mm,Z_mm,A_deg,C_deg\n"), HasSubstr("missing: X_mm"));
  EXPECT_THAT(message(kHead + rows(12) + "0.001,1,2,3,4,5\n"), HasSubstr("t.csv:15"));
  EXPECT_THAT(message(kHead + rows(12) + "0.001,1,2,3,4,5\n"), HasSubstr("the time goes back"));
  EXPECT_THAT(message(kHead + rows(12) + "1,1,2,x,4,5\n"), HasSubstr("t.csv:15:4"));
  EXPECT_THAT(message(kHead + rows(9)), HasSubstr("9 complete rows"));
  EXPECT_THAT(message(kHead + rows(12) + "1,1,2,3,4,1e12\n"),
              HasSubstr("t.csv:15: error: 1e+12 is beyond any axis"));
  EXPECT_THAT(message(kHead + rows(12) + "1e13,1,2,3,4,5\n"),
              HasSubstr("t.csv:15: error: 1e+13 is beyond any clock"));
  EXPECT_THAT(message("# positions: there\n" + (kHead + rows(12))), HasSubstr("'there'"));
}

TEST(TraceFile, ReadsListsWithNamedFields) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::string text;
  for (int i = 0; i < 12; ++i) text += std::to_string(i + 40) + " 1 1.5 2 3 90 180 7 \n";
  text += "overrun\n";
  Diagnostics diagnostics;
  const auto trace =
      parse_list(text, "l.txt", machine,
                 {{"sample", "-", "X_mm", "Y_mm", "Z_mm", "A_deg", "C_deg", "block"}, 0.002}, diagnostics);
  ASSERT_TRUE(trace) << trace.error().text();
  EXPECT_NEAR(trace->samples[5].time_s, 0.090, 1e-12);
  EXPECT_EQ(trace->samples[5].nc_line, 7U);
  EXPECT_NEAR(trace->samples[5].q[3], kPi / 2, 1e-15);
  ASSERT_EQ(diagnostics.findings().size(), 1U);
  EXPECT_THAT(diagnostics.findings()[0].message, HasSubstr("overrun"));
}

// As recorders write them where the decimal sign is a comma.
TEST(TraceFile, TakesCommasOfDecimalsWhereSemicolonsOrTabsPartTheFields) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const char between : {';', '\t', ','}) {
    std::string text = "Zeit;X;Y;Z;A;C\n";
    for (int i = 0; i < 12; ++i) {
      std::string line = std::to_string(i) + "|1,25|-2,5|3|90,0|180";
      if (between == ',') std::replace(line.begin(), line.end(), ',', '.');
      std::replace(line.begin(), line.end(), '|', between);
      text += line + "\r\n";
    }
    Diagnostics diagnostics;
    const auto trace = parse_list(
        text, "l.csv", machine, {{"time_ms", "X_mm", "Y_mm", "Z_mm", "A_deg", "C_deg"}, 0.001}, diagnostics);
    ASSERT_TRUE(trace) << trace.error().text();
    EXPECT_EQ(trace->samples[7].q[0], 1.25);
    EXPECT_EQ(trace->samples[7].q[1], -2.5);
    EXPECT_NEAR(trace->samples[7].time_s, 0.007, 1e-12);
  }
}

}  // namespace
}  // namespace trunnion::trace
