// Real machines: 46 h of a machining centre (FL_THERMAL) and 17 days of a lathe. Prints the tables that
// src/thermal/README.md quotes.
#include <cstdio>
#include <cstdlib>
#include <gtest/gtest.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/thermal/import_log.hpp"
#include "trunnion/thermal/validation.hpp"

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

}  // namespace
}  // namespace trunnion::thermal
