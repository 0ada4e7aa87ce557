#include "trunnion/thermal/log.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/thermal/import_log.hpp"

#include "support/folders.hpp"
#include "thermal/day_log.hpp"
#include "thermal/foreign_text.hpp"

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

// Days in files of their own: one name for two of them, and one day under two names.
TEST(ThermalLog, RunsOfSeveralFilesAreHeldAgainstEachOther) {
  const auto message = [](const std::string& first, const std::string& second) {
    const std::string folder = test::binary_folder();
    const std::vector<std::string> paths = {folder + "/log_first.csv", folder + "/log_second.csv"};
    EXPECT_TRUE(write_file(paths[0], first));
    EXPECT_TRUE(write_file(paths[1], second));
    Diagnostics diagnostics;
    const auto log = load_logs(paths, diagnostics);
    return log ? std::string("no error") : log.error().text();
  };
  const std::string day = "0,20.5,1\n10,20.6,2\n20,20.7,4\n";
  const std::string head = "time_s,T_front_degC,dx_um\n";
  const auto of_run = [&](const std::string& id, std::string rows) {
    for (std::size_t at = 0; at < rows.size(); at = rows.find('\n', at) + 1) rows.insert(at, id + ",");
    return "run_id," + head + rows;
  };
  EXPECT_THAT(message(head + day, head + "5,20.5,1\n10,22.6,2\n"),
              ::testing::HasSubstr(
                  "log_second.csv: error: run '1' has two values of sensor front at 10 s, 20.6 and 22.6"));
  EXPECT_THAT(message(head + day, head + "10,20.6,3\n"), ::testing::HasSubstr("two values of dx at 10 s"));
  // What one file lacks the other may have.
  EXPECT_EQ(message(head + day, "time_s,T_rear_degC\n0,20\n10,21\n"), "no error");
  EXPECT_EQ(message(head + day, head + "10,20.6,2\n30,20.8,5\n"), "no error");
  EXPECT_THAT(
      message(of_run("monday", day), of_run("tuesday", day)),
      ::testing::HasSubstr("run 'tuesday' has the readings and temperatures of run 'monday', row by row"));
  EXPECT_EQ(message(of_run("monday", day), of_run("tuesday", "0,20.5,1\n10,20.6,2\n20,20.7,5\n")),
            "no error");
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

std::string messages_of(const Diagnostics& diagnostics) {
  std::string out;
  for (const Finding& f : diagnostics.findings()) out += f.text() + "\n";
  return out;
}

// What loggers write: semicolons, decimal commas, dates, N/A, a column without a name at the end.
TEST(ThermalImport, ReadsWhatLoggersWrite) {
  ImportOptions options;
  options.sensors = {"PT*"};
  options.channels = {"Z"};
  Diagnostics diagnostics;
  const auto log = import_log(
      "logger 7\nZeit;PT front;PT rear;Z;note;\n2024-03-01T07:59:30+01:00;20,5;N/A;1.234,5;a;\n"
      "2024-03-01T07:00:00Z;20,6;21,25;-3;b;\n01.03.2024 07:00:30,5;20,7;--;;c;\n",
      "l.csv",
      [&] {
        auto o = options;
        o.skip_lines = 1;
        return o;
      }(),
      diagnostics);
  ASSERT_TRUE(log) << log.error().text();
  EXPECT_EQ(log->sensors, (std::vector<std::string>{"PT front", "PT rear"}));
  EXPECT_EQ(log->runs[0].time_s, (std::vector<double>{0.0, 30.0, 60.5}));
  EXPECT_EQ(log->runs[0].temperature_degC[0], (std::vector<double>{20.5, 20.6, 20.7}));
  EXPECT_TRUE(std::isnan(log->runs[0].temperature_degC[1][0]));
  EXPECT_NEAR(log->runs[0].channel_mm[0][0], 1.2345, 1e-12);
  const std::string told = messages_of(diagnostics);
  EXPECT_NE(told.find("2 fields like N/A count as not read"), std::string::npos) << told;
  EXPECT_NE(told.find("l.csv:2:5: note: column 'note' is ignored"), std::string::npos) << told;
}

TEST(ThermalImport, SaysWhatIsMissing) {
  const auto message = [](const std::string& text, const ImportOptions& options) {
    Diagnostics diagnostics;
    const auto log = import_log(text, "l.csv", options, diagnostics);
    return log ? std::string("taken") : messages_of(diagnostics);
  };
  ImportOptions options;
  const std::string table = "a_C\tz_um\n20\t1\n21\t2\n";
  EXPECT_NE(message(table, options).find("--step-s"), std::string::npos);
  options.step_s = 10.0;
  EXPECT_EQ(message(table, options), "taken");
  EXPECT_NE(message("a_C\n20\n", options).find("--channel PATTERN"), std::string::npos);
  EXPECT_NE(message("z_um\n20\n", options).find("--sensor PATTERN"), std::string::npos);
  options.part = true;
  EXPECT_EQ(message("a_C\n20\n", options), "taken");
  options.sensors = {"PT*"};
  EXPECT_NE(message(table, options).find("no column 'PT*'"), std::string::npos);
}

// Milliseconds that are taken for seconds make a day of a warm-up of a minute and a half.
TEST(ThermalImport, KnowsTheUnitOfTheTimeByItsNameOrSaysThatThereIsNone) {
  const auto read = [](const std::string& name, const std::string& column, std::string& told,
                       std::optional<double> given = {}) {
    ImportOptions options;
    options.time_column = column;
    options.seconds_per_count = given;
    Diagnostics diagnostics;
    const auto log = import_log(name + ",a_C,z_um\n1000,20,1\n3000,21,2\n", "l.csv", options, diagnostics);
    told = messages_of(diagnostics);
    return log ? log->runs[0].time_s[1] : -1.0;
  };
  std::string told;
  for (const auto& [name, seconds] :
       {std::pair{"time_s", 2000.0}, std::pair{"time_ms", 2.0}, std::pair{"Time [ms]", 2.0},
        std::pair{"TIME(min)", 120000.0}, std::pair{"timestamp_us", 0.002}, std::pair{"Zeit / h", 7.2e6}}) {
    EXPECT_NEAR(read(name, "", told), seconds, 1e-9 * seconds) << name;
    EXPECT_EQ(told, "") << name;
  }
  EXPECT_NEAR(read("t_ms", "t_ms", told), 2.0, 1e-12);
  EXPECT_EQ(told, "");
  EXPECT_NEAR(read("time_ms", "", told, 60.0), 120000.0, 1e-6);
  EXPECT_EQ(told, "");
  for (const std::string name : {"time", "n", "heat_mass"}) {
    EXPECT_NEAR(read(name, name, told), 2000.0, 1e-9) << name;
    EXPECT_NE(told.find("l.csv:1:1: warning: column '" + name + "' names no unit"), std::string::npos)
        << told;
    EXPECT_NE(told.find("rows 2000 s apart"), std::string::npos) << told;
  }
}

TEST(ThermalImport, KnowsTheUnitOfAChannelByItsName) {
  ImportOptions options;
  options.channels = {"Z*"};
  for (const auto& [name, mm] :
       {std::pair{"Z_um", 0.003}, std::pair{"Z_mm", 3.0}, std::pair{"Z", 0.006}, std::pair{"Z [mm]", 3.0},
        std::pair{"Z (um)", 0.003}, std::pair{"Z_nm", 3e-6}, std::pair{"Z / inch", 76.2},
        std::pair{"Z [in]", 76.2}}) {
    options.um_per_count = 2.0;
    Diagnostics diagnostics;
    const auto log =
        import_log("time_s,a_C," + std::string(name) + "\n0,20,3\n", "l.csv", options, diagnostics);
    ASSERT_TRUE(log) << log.error().text();
    EXPECT_NEAR(log->runs[0].channel_mm[0][0], mm, 1e-12) << name;
    EXPECT_EQ(log->channels, std::vector<std::string>{"Z"});
  }
}

// Before: 71.6 degF were 71.6 degC, without a word.
TEST(ThermalImport, KnowsTheUnitOfASensorByItsName) {
  const auto read = [](const std::string& name, const std::string& values, std::string& told) {
    ImportOptions options;
    options.sensors = {"PT*"};
    Diagnostics diagnostics;
    const auto log =
        import_log("time_s," + name + ",Z_um\n0," + values + ",1\n", "l.csv", options, diagnostics);
    told = messages_of(diagnostics);
    return log ? log->runs[0].temperature_degC[0][0] : std::nan("");
  };
  std::string told;
  for (const auto& [name, number] :
       {std::pair{"PT_degF", "71.6"}, std::pair{"PT [degF]", "71.6"}, std::pair{"PT (K)", "295.15"},
        std::pair{"PT_F", "71.6"}, std::pair{"PT_degC", "22"}, std::pair{"PT [C]", "22"},
        std::pair{"PT", "22"}}) {
    EXPECT_NEAR(read(name, number, told), 22.0, 1e-9) << name << told;
    EXPECT_EQ(told.find("is taken for 22.0 degC") != std::string::npos, std::string(number) != "22")
        << name << told;
  }
  // The front, in degrees Celsius.
  EXPECT_TRUE(std::isnan(read("PT_F", "22.4", told)));
  EXPECT_NE(
      told.find("l.csv:1:2: error: column 'PT_F' ends like degrees Fahrenheit, and its numbers, about 22.4"),
      std::string::npos)
      << told;
}

TEST(ThermalImport, DatesAreSecondsOfTheEpoch) {
  EXPECT_EQ(seconds_of_date("1970-01-01T00:00:00Z"), 0.0);
  EXPECT_EQ(seconds_of_date("2000-03-01 00:00"), 951868800.0);  // the day after a 29 February
  EXPECT_EQ(seconds_of_date("2000-03-01T02:00:00+02:00"), 951868800.0);
  EXPECT_EQ(seconds_of_date("01.03.2000 00:00:00"), 951868800.0);
  EXPECT_FALSE(seconds_of_date("2001-02-29T00:00:00"));
  EXPECT_FALSE(seconds_of_date("20.5"));
}

}  // namespace
}  // namespace trunnion::thermal
