// Time of the reader of thermal logs: a day at 30 Hz with eight sensors is 2.6 million rows, wanted in less
// than 2 s.
#include <benchmark/benchmark.h>
#include <cstdint>
#include <string>

#include "trunnion/thermal/log.hpp"

#include "thermal/day_log.hpp"

namespace {

using namespace trunnion;

void thermal_log_of_a_day(benchmark::State& state) {
  const std::string text = test::day_log_text();
  for (auto _ : state) {
    Diagnostics diagnostics;
    const auto log = thermal::parse_log(text, "day.csv", diagnostics);
    if (!log || log->runs.size() != 1 || log->runs[0].rows() != test::kDayRows) {
      state.SkipWithError("the log was not read");
      return;
    }
    benchmark::DoNotOptimize(log->runs[0].temperature_degC[7][12345]);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(test::kDayRows));
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(text.size()));
}

BENCHMARK(thermal_log_of_a_day)->Unit(benchmark::kSecond);

}  // namespace

BENCHMARK_MAIN();
