#include "trunnion/thermal/condition.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace trunnion::thermal {
namespace {

// Two sensors over three hours, a reading every 10 s; the second one rises by 9 K.
Log plain_log() {
  Log log;
  log.file = "log.csv";
  log.sensors = {"a", "b"};
  LogRun run;
  run.id = "day";
  run.temperature_degC.resize(2);
  for (int i = 0; i < 1080; ++i) {
    run.time_s.push_back(10.0 * i);
    run.temperature_degC[0].push_back(20.0 + 0.004 * i);
    run.temperature_degC[1].push_back(20.0 + 9.0 * i / 1080.0);
  }
  log.runs.push_back(std::move(run));
  return log;
}

std::vector<SensorFault> faults_of(const Log& log, Log* cleaned = nullptr) {
  std::vector<SensorFault> faults;
  const Log out = without_faults(log, SensorLimits{}, faults);
  if (cleaned != nullptr) *cleaned = out;
  return faults;
}

TEST(SensorFaults, NoneInAGoodLog) {
  EXPECT_TRUE(faults_of(plain_log()).empty());
}

TEST(SensorFaults, ABrokenWireIsTakenOut) {
  Log log = plain_log();
  for (std::size_t i = 100; i < 110; ++i) log.runs[0].temperature_degC[0][i] = 850.0;
  Log cleaned;
  const auto faults = faults_of(log, &cleaned);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].text(), "run 'day', sensor 'a': out of range from 1000 s to 1090 s (10 readings)");
  EXPECT_TRUE(std::isnan(cleaned.runs[0].temperature_degC[0][105]));
  EXPECT_FALSE(std::isnan(cleaned.runs[0].temperature_degC[0][110]));
}

TEST(SensorFaults, ASpikeComesBackAndAJumpDoesNot) {
  Log log = plain_log();
  log.runs[0].temperature_degC[0][50] += 12.0;
  for (std::size_t i = 600; i < 1080; ++i) log.runs[0].temperature_degC[1][i] -= 8.0;
  Log cleaned;
  const auto faults = faults_of(log, &cleaned);
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_EQ(faults[0].kind, FaultKind::spike);
  EXPECT_EQ(faults[0].readings, 1U);
  EXPECT_EQ(faults[1].kind, FaultKind::jump);
  EXPECT_EQ(faults[1].from_s, 6000.0);
  EXPECT_TRUE(std::isnan(cleaned.runs[0].temperature_degC[1][1079]));
  std::vector<std::string> left_out;
  EXPECT_EQ(without_faulty_sensors(cleaned, faults, left_out).sensors, std::vector<std::string>{"a"});
  EXPECT_EQ(left_out, std::vector<std::string>{"b"});
}

TEST(SensorFaults, AStuckSensorIsOneThatStandsWhileOthersMove) {
  Log log = plain_log();
  for (std::size_t i = 200; i < 1080; ++i) log.runs[0].temperature_degC[0][i] = 20.8;
  const auto faults = faults_of(log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].kind, FaultKind::stuck);
  // An even temperature in an even shop is no fault.
  for (auto& column : log.runs[0].temperature_degC) std::fill(column.begin(), column.end(), 20.0);
  EXPECT_TRUE(faults_of(log).empty());
}

TEST(SensorFaults, AGapIsReportedAndASlowSensorHasNone) {
  Log log = plain_log();
  for (std::size_t i = 300; i < 360; ++i) log.runs[0].temperature_degC[0][i] = std::nan("");
  for (std::size_t i = 0; i < 1080; ++i) {
    if (i % 60 != 0) log.runs[0].temperature_degC[1][i] = std::nan("");  // every ten minutes
  }
  const auto faults = faults_of(log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].kind, FaultKind::gap);
  EXPECT_EQ(faults[0].from_s, 2990.0);
  EXPECT_EQ(faults[0].to_s, 3600.0);
}

TEST(Resampling, AveragesFastLogsAndLeavesSlowOnes) {
  Log log;
  log.sensors = {"a"};
  log.channels = {"dx"};
  LogRun run;
  run.id = "1";
  run.temperature_degC.resize(1);
  run.channel_mm.resize(1);
  for (int i = 0; i < 3000; ++i) {
    run.time_s.push_back(5.0 + i / 30.0);
    run.temperature_degC[0].push_back(i % 2 == 0 ? 20.0 : 21.0);
    run.channel_mm[0].push_back(i == 1500 ? 0.03 : std::nan(""));
  }
  log.runs.push_back(std::move(run));
  const Log out = resampled(log, 15.0);
  ASSERT_EQ(out.runs[0].rows(), 7U);
  EXPECT_NEAR(out.runs[0].temperature_degC[0][2], 20.5, 1e-12);
  EXPECT_NEAR(out.runs[0].time_s[0], 5.0 + 449.0 / 60.0, 1e-9);
  EXPECT_EQ(std::count_if(out.runs[0].channel_mm[0].begin(), out.runs[0].channel_mm[0].end(),
                          [](double v) { return v == 0.03; }),
            1);
  EXPECT_EQ(resampled(out, 10.0).runs[0].rows(), 7U);
}

}  // namespace
}  // namespace trunnion::thermal
