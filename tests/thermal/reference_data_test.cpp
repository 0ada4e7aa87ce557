// Real machines: 46 h of a machining centre (FL_THERMAL) and 17 days of a lathe. Prints the tables that
// src/thermal/README.md quotes.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <gtest/gtest.h>
#include <map>
#include <stdexcept>

#include "trunnion/base/files.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/thermal/import_log.hpp"
#include "trunnion/thermal/predictor.hpp"
#include "trunnion/thermal/validation.hpp"

#include "thermal/bench.hpp"

namespace trunnion::thermal {
namespace {

std::optional<Log> reference_log(const std::string& path, const ImportOptions& options) {
  const char* folder = std::getenv("TRUNNION_REFERENCE_DATA");
  if (folder == nullptr) return std::nullopt;
  const auto text = read_file(std::string(folder) + path);
  if (!text) return std::nullopt;
  Diagnostics diagnostics;
  auto log = import_log(*text, path, options, diagnostics);
  EXPECT_TRUE(log) << log.error().text();
  return log ? std::optional(std::move(*log)) : std::nullopt;
}

// A run is four hours with the spindle on and the four hours off that follow.
std::optional<Log> fl_thermal() {
  ImportOptions options;
  options.run_starts_with_spindle = true;
  return reference_log("/thermal/fl_thermal_mit/fl_thermal_15s.csv", options);
}

// The file numbers its samples; two minutes between them are assumed (the machine's user gives no time).
std::optional<Log> lathe_days() {
  ImportOptions options;
  options.time_column = "sample";
  options.seconds_per_count = 120.0;
  options.run_column = "day";
  options.channels = {"dia_disp"};
  return reference_log("/thermal/lathe_days/ace_days.csv", options);
}

void print(const ChannelReport& channel) {
  std::printf("%-18s %8s %8s %8s %8s %8s %8s   [um]\n", channel.channel.c_str(), "rmse", "p95", "worst",
              "run mean", "3 h", "3h worst");
  const auto line = [](const Score& s, bool chosen) {
    std::printf("%c %-16s %8.2f %8.2f %8.2f %8.2f %8.2f %8.2f\n", chosen ? '*' : ' ', s.name.c_str(),
                s.rmse_mm / kMmPerUm, s.p95_mm / kMmPerUm, s.worst_run_rmse_mm / kMmPerUm,
                s.mean_run_rmse_mm / kMmPerUm, s.window_rmse_mm / kMmPerUm,
                s.window_worst_rmse_mm / kMmPerUm);
  };
  for (const Score& s : channel.models) line(s, s.name == channel.chosen);
  if (channel.nested) line(*channel.nested, false);
  for (const auto& note : channel.notes) std::printf("  %s\n", note.c_str());
  std::fflush(stdout);
}

// The default model against holding the last measurement, over the first three hours and over whole runs.
void expect_better_than_hold_last(const Log& log, double share) {
  Diagnostics diagnostics;
  const auto result = fit_thermal(log, {}, diagnostics);
  ASSERT_TRUE(result) << result.error().text();
  for (const ChannelReport& channel : result->channels) {
    print(channel);
    const Score& hold = *channel.score("hold_last");
    ASSERT_TRUE(channel.nested);
    for (const Score* score : {channel.score(channel.chosen), &*channel.nested}) {
      EXPECT_LT(score->rmse_mm, share * hold.rmse_mm) << channel.channel << " " << score->name;
      EXPECT_LT(score->window_rmse_mm, share * hold.window_rmse_mm) << channel.channel << " " << score->name;
    }
  }
}

TEST(LongThermalReference, FlThermalBeatsHoldingTheLastMeasurementByAQuarter) {
  const auto log = fl_thermal();
  if (!log) GTEST_SKIP() << "no reference data";
  ASSERT_EQ(log->runs.size(), 6U);
  expect_better_than_hold_last(*log, 0.75);
}

TEST(LongThermalReference, LatheDaysBeatHoldingTheLastMeasurementByAQuarter) {
  const auto log = lathe_days();
  if (!log) GTEST_SKIP() << "no reference data";
  ASSERT_EQ(log->runs.size(), 17U);
  expect_better_than_hold_last(*log, 0.75);
}

// The first `end` rows of a run.
LogRun beginning(const LogRun& run, std::size_t end) {
  LogRun out = run;
  const auto cut = [&](std::vector<double>& column) { column.resize(std::min(column.size(), end)); };
  cut(out.time_s);
  cut(out.spindle_rpm);
  cut(out.feed_mm_s);
  for (auto& column : out.temperature_degC) cut(column);
  for (auto& column : out.channel_mm) cut(column);
  return out;
}

// Root mean square of predicted minus measured from row `from` on, relative to the run's first measurement.
double rmse_from(const ThermalModel& model, const Log& log, std::size_t run, std::size_t from,
                 UseMeasurements use) {
  const auto prediction = predict(model, log, run, use);
  if (!prediction) throw std::runtime_error(prediction.error().text());
  const auto& measured = log.runs[run].channel_mm[*log.channel(model.channels[0].channel)];
  double sum = 0.0;
  double n = 0.0;
  for (std::size_t row = from; row < measured.size(); ++row, n += 1.0)
    sum += std::pow(prediction->channel[0][row].value_mm - (measured[row] - measured[0]), 2);
  return std::sqrt(sum / n);
}

// Trained on the four hours of each run with the spindle on, used over the four hours of cooling of a run
// that was held out: what thermal models are known to fail at.
TEST(LongThermalReference, CoolingIsOutsideATrainingOnWarmUps) {
  const auto log = fl_thermal();
  if (!log) GTEST_SKIP() << "no reference data";
  std::vector<std::size_t> end;
  for (const LogRun& run : log->runs) {
    std::size_t rows = run.rows();
    while (rows > 1 && !(run.spindle_rpm[rows - 1] > 0.0)) --rows;
    end.push_back(rows);
  }
  for (const Method method : {Method::ridge, Method::combined}) {
    for (const std::string channel : {"ch3", "ch5"}) {
      std::map<std::string, double> squares;
      for (std::size_t held = 0; held < log->runs.size(); ++held) {
        Log training = *log;
        training.runs.clear();
        for (std::size_t r = 0; r < log->runs.size(); ++r) {
          if (r != held) training.runs.push_back(beginning(log->runs[r], end[r]));
        }
        const std::size_t index = static_cast<std::size_t>(
            std::find_if(log->channels.begin(), log->channels.end(),
                         [&](const auto& name) { return name.starts_with(channel); }) -
            log->channels.begin());
        ChannelBench bench(training, index, 1800.0);
        const auto note = [&](const std::string& name, Candidate candidate, UseMeasurements use, bool guard) {
          const auto fitted = fit_candidate(bench, candidate, {0, 1, 2, 3, 4});
          if (!fitted) throw std::runtime_error(fitted.error().text());
          ThermalModel model;
          ChannelModel c;
          c.channel = log->channels[index];
          c.candidate = candidate;
          c.features = features_of(candidate.method, training);
          c.regressor = fitted->regressor;
          c.typical_change_mm = fitted->typical_change_mm;
          if (guard) c.guard = fitted->guard;
          model.channels.push_back(std::move(c));
          squares[name] += std::pow(rmse_from(model, *log, held, end[held], use), 2);
        };
        note("none", {Method::none, Anchor::open}, UseMeasurements::no, true);
        note("hold_last", {Method::hold_last, Anchor::open}, UseMeasurements::yes, true);
        note("open", {method, Anchor::open}, UseMeasurements::no, true);
        note("open, no guard", {method, Anchor::open}, UseMeasurements::no, false);
        note("update", {method, Anchor::update}, UseMeasurements::yes, true);
        note("update, no guard", {method, Anchor::update}, UseMeasurements::yes, false);
      }
      std::map<std::string, double> rmse;
      std::printf("%s %s, cooling, trained on warm-ups [um]:", channel.c_str(), method_name(method).c_str());
      for (const auto& [name, square] : squares) {
        rmse[name] = std::sqrt(square / static_cast<double>(log->runs.size())) / kMmPerUm;
        std::printf(" %s %.2f;", name.c_str(), rmse[name]);
      }
      std::printf("\n");
      EXPECT_LT(rmse["update"], rmse["hold_last"]) << channel;
    }
  }
}

}  // namespace
}  // namespace trunnion::thermal
