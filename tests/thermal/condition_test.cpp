#include "trunnion/thermal/condition.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "trunnion/thermal/screening.hpp"
#include "trunnion/thermal/validation.hpp"

#include "thermal/stuck.hpp"

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
  const auto left_out = judge_sensors(cleaned, faults, {});
  EXPECT_EQ(without_sensors(cleaned, left_out).sensors, std::vector<std::string>{"a"});
  ASSERT_EQ(left_out.size(), 1U);
  EXPECT_EQ(left_out[0].sensor, "b");
  EXPECT_EQ(left_out[0].file, "log.csv");
  EXPECT_TRUE(judge_sensors(cleaned, faults, {"b"}).empty());
  EXPECT_TRUE(judge_sensors(cleaned, faults, {"all"}).empty());
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

// All rises of a run count from its first reading: a wrong one is named, and not the good ones behind it.
TEST(SensorFaults, AWrongStartIsTakenOutAndNotWhatFollows) {
  for (const double by_K : {3.0, 40.0, -20.0}) {
    Log log = plain_log();
    for (std::size_t i = 0; i < 1080; ++i) log.runs[0].temperature_degC[1][i] += i % 2 == 0 ? 0.1 : 0.0;
    log.runs[0].temperature_degC[1][0] += by_K;
    Log cleaned;
    const auto faults = faults_of(log, &cleaned);
    ASSERT_EQ(faults.size(), 1U) << by_K;
    EXPECT_EQ(faults[0].text(), "run 'day', sensor 'b': spike from 0 s to 0 s (1 readings)");
    EXPECT_TRUE(std::isnan(cleaned.runs[0].temperature_degC[1][0]));
    EXPECT_FALSE(std::isnan(cleaned.runs[0].temperature_degC[1][1]));
  }
  // Ten minutes of an hour are the fault, not the fifty behind them.
  Log log = plain_log();
  for (std::size_t i = 0; i < 60; ++i) log.runs[0].temperature_degC[1][i] = 85.0;
  Log cleaned;
  ASSERT_EQ(faults_of(log, &cleaned).size(), 1U);
  EXPECT_TRUE(std::isnan(cleaned.runs[0].temperature_degC[1][59]));
  EXPECT_FALSE(std::isnan(cleaned.runs[0].temperature_degC[1][60]));
}

// A machine that begins to move is no fault, however fast, nor is a sensor in steps of a kelvin.
TEST(SensorFaults, AGoodStartStays) {
  Log log = plain_log();
  for (std::size_t i = 0; i < 1080; ++i) {
    const double t = 10.0 * static_cast<double>(i);
    log.runs[0].temperature_degC[0][i] = 22.0 + (t < 150.0 ? 0.0 : 15.0 * -std::expm1((150.0 - t) / 600.0));
    log.runs[0].temperature_degC[1][i] = 20.0 + 12.0 * -std::expm1(-t / 120.0);
  }
  EXPECT_TRUE(faults_of(log).empty());
  for (std::size_t i = 0; i < 1080; ++i) log.runs[0].temperature_degC[1][i] = i == 0 ? 20.0 : 21.0;
  for (const SensorFault& fault : faults_of(log)) EXPECT_EQ(fault.kind, FaultKind::stuck);
}

// A reading that stays away is no spike only because a minute has passed.
TEST(SensorFaults, AJumpOfASlowLoggerStaysAJump) {
  Log log = plain_log();
  for (std::size_t i = 0; i < 1080; ++i) log.runs[0].time_s[i] = 30.0 * static_cast<double>(i);
  for (std::size_t i = 600; i < 1080; ++i) log.runs[0].temperature_degC[1][i] = 0.0;
  const auto faults = faults_of(log);
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults[0].kind, FaultKind::jump);
  EXPECT_EQ(faults[0].readings, 480U);
}

// Four days of a spindle that runs for two hours and rests for two, a reading every 30 s: three sensors with
// a lag of 20 min, 1 h and 3 h behind the first one's heat, in steps of 0.1 K; the slowest stands for an hour
// and more.
Log coarse_log() {
  Log log;
  log.file = "spindle.csv";
  log.sensors = {"front", "head", "column", "bed"};
  for (int day = 0; day < 4; ++day) {
    LogRun run;
    run.id = std::to_string(day + 1);
    run.temperature_degC.resize(4);
    std::vector<double> level(4, 0.0);
    const std::vector<double> tau_s = {600.0, 1200.0, 3600.0, 10800.0};
    const std::vector<double> gain_K = {14.0, 7.0, 2.0, 0.7};
    for (int i = 0; i < 480; ++i) {
      run.time_s.push_back(30.0 * i);
      const double load = i < 240 ? 1.0 + 0.2 * day : 0.0;
      for (std::size_t s = 0; s < 4; ++s) {
        run.temperature_degC[s].push_back(std::round((20.0 + day + level[s]) * 10.0) / 10.0);
        level[s] += -std::expm1(-30.0 / tau_s[s]) * (gain_K[s] * load - level[s]);
      }
    }
    log.runs.push_back(std::move(run));
  }
  return log;
}

TEST(SensorFaults, ASlowSensorInCoarseStepsIsNotStuck) {
  const Log log = coarse_log();
  // It does stand for an hour while others move by many kelvin ...
  EXPECT_GT(standstills(log, 3, SensorLimits{}).size(), 0U);
  EXPECT_TRUE(faults_of(log).empty());  // ... as they let expect.
}

TEST(SensorFaults, AmongCoarseSensorsTheStuckOneIsFound) {
  for (std::size_t sensor = 0; sensor < 3; ++sensor) {
    Log log = coarse_log();
    auto& column = log.runs[2].temperature_degC[sensor];
    std::fill(column.begin() + 20, column.end(), column[20]);
    const auto faults = faults_of(log);
    ASSERT_EQ(faults.size(), 1U) << sensor;
    EXPECT_EQ(faults[0].sensor, log.sensors[sensor]);
    EXPECT_EQ(faults[0].run, "3");
    EXPECT_NE(faults[0].text().find("the other sensors let expect a change of"), std::string::npos);
    EXPECT_EQ(judge_sensors(log, faults, {}).size(), 1U);
  }
  Log dead = coarse_log();
  for (LogRun& run : dead.runs)
    std::fill(run.temperature_degC[1].begin(), run.temperature_degC[1].end(), 21.0);
  const auto faults = faults_of(dead);
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults[0].sensor, "head");
  EXPECT_NE(faults[0].text().find("it never moves"), std::string::npos);
}

// With noise in its steps a sensor says itself that it stands, where the others were seen too short to judge.
TEST(SensorFaults, ASensorThatStopsFlickeringIsStuck) {
  for (const std::size_t runs : {1U, 2U}) {
    Log log = coarse_log();
    log.runs.resize(runs);
    for (std::size_t s = 0; s < 4; ++s) {
      for (LogRun& run : log.runs) {
        for (std::size_t i = 0; i < 480; i += 3) run.temperature_degC[s][i] += 0.1;
      }
    }
    EXPECT_TRUE(faults_of(log).empty());
    auto& column = log.runs[0].temperature_degC[1];
    std::fill(column.begin() + 60, column.end(), column[60]);
    const auto faults = faults_of(log);
    ASSERT_EQ(faults.size(), 1U) << runs;
    EXPECT_EQ(faults[0].sensor, "head");
  }
}

// A few readings out of range are taken out and cost no sensor; many do, and one that is silent for a run.
TEST(SensorFaults, AFewReadingsOutOfRangeSpoilNoSensor) {
  Log log = coarse_log();
  for (std::size_t i = 100; i < 105; ++i) log.runs[0].temperature_degC[0][i] = -999.0;
  for (std::size_t i = 100; i < 200; ++i) log.runs[0].temperature_degC[1][i] = 999.0;
  for (double& value : log.runs[1].temperature_degC[2]) value = std::nan("");
  Log cleaned;
  const auto faults = faults_of(log, &cleaned);
  const auto left_out = judge_sensors(cleaned, faults, {});
  ASSERT_EQ(left_out.size(), 2U);
  EXPECT_EQ(left_out[0].sensor, "head");
  EXPECT_EQ(left_out[1].sensor, "column");
}

// A day in kelvin spoils itself and not the sensors of the other days; without any day there is an error.
TEST(SensorFaults, ADayWithoutAUsableSensorIsLeftOut) {
  Log log = coarse_log();
  const auto in_kelvin = [](LogRun& run) {
    for (auto& column : run.temperature_degC) {
      for (double& value : column) value += 273.15;
    }
  };
  in_kelvin(log.runs[1]);
  for (auto& column : log.runs[3].temperature_degC) std::fill(column.begin(), column.end(), std::nan(""));
  Log cleaned;
  auto faults = faults_of(log, &cleaned);
  Diagnostics diagnostics;
  for (const std::vector<std::string>& keep : {std::vector<std::string>{}, {"all"}}) {
    const auto usable = usable_for_fit(cleaned, faults, keep, diagnostics);
    ASSERT_TRUE(usable);
    ASSERT_EQ(usable->runs.size(), 2U);
    EXPECT_EQ(usable->runs[1].id, "3");
    EXPECT_EQ(usable->sensors.size(), 4U);
  }
  EXPECT_EQ(diagnostics.findings()[0].text(),
            "spindle.csv: warning: run '2' is left out, since none of its sensors can be used: run '2', "
            "sensor 'front': out of range from 0 s to 14370 s (480 readings)");
  for (const std::size_t run : {0U, 2U}) in_kelvin(log.runs[run]);
  faults = faults_of(log, &cleaned);
  const auto none = usable_for_fit(cleaned, faults, {}, diagnostics);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().text().find("no run is left"), std::string::npos);
}

TEST(SensorFaults, AreToldInOneLineEachWithTheFileOfTheSensor) {
  Diagnostics diagnostics;
  const auto a = parse_log("run_id,time_s,T_a_degC\n1,0,20\n1,60,21\n", "a.csv", diagnostics);
  Log log = coarse_log();
  for (LogRun& run : log.runs) {
    run.sensor_file = {"one.csv", "one.csv", "two.csv", "two.csv"};
    for (std::size_t i = 50; i < 450; i += 100) run.temperature_degC[2][i] += 30.0;
  }
  tell_faults(log, faults_of(log), diagnostics);
  ASSERT_TRUE(a);
  EXPECT_EQ(a->runs[0].sensor_file, std::vector<std::string>{"a.csv"});
  ASSERT_EQ(diagnostics.findings().size(), 1U);
  EXPECT_EQ(
      diagnostics.findings()[0].text(),
      "two.csv: warning: run '1', sensor 'column': spike from 1500 s to 1500 s (1 readings); 16 times in 4 "
      "runs, 16 readings in all");
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

// Nothing to learn from is an error, and a speed alone is enough.
TEST(SensorFaults, AFitWithoutSensorsSaysSo) {
  Log log = coarse_log();
  log.sensors.clear();
  log.channels = {"dx"};
  for (LogRun& run : log.runs) {
    run.temperature_degC.clear();
    run.channel_mm.assign(1, std::vector<double>(run.rows(), std::nan("")));
    for (std::size_t i = 0; i < run.rows(); i += 60) run.channel_mm[0][i] = 1e-4 * static_cast<double>(i);
  }
  Diagnostics diagnostics;
  EXPECT_FALSE(fit_thermal(log, {}, diagnostics));
  EXPECT_FALSE(screen(log, {}, 1800.0));
  log.has_speed = true;
  for (LogRun& run : log.runs) run.spindle_rpm.assign(run.rows(), 5000.0);
  EXPECT_TRUE(fit_thermal(log, {}, diagnostics));
}

TEST(SensorFaults, ASensorThatFallsSilentIsTold) {
  Log log = plain_log();
  for (std::size_t i = 500; i < 1080; ++i) log.runs[0].temperature_degC[0][i] = std::nan("");
  const auto faults = faults_of(log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].text(),
            "run 'day', sensor 'a': gap from 4990 s to 10790 s (0 readings): silent to the end of the run");
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
