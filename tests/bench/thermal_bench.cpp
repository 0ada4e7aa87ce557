// Time of the reader of thermal logs: a day at 30 Hz with eight sensors is 2.6 million rows, wanted in less
// than 2 s.
#include <benchmark/benchmark.h>
#include <cstddef>
#include <string>

#include "trunnion/base/number_text.hpp"
#include "trunnion/thermal/log.hpp"

namespace {

using namespace trunnion;

constexpr std::size_t kRows = 24UL * 3600UL * 30UL;

std::string day_text() {
  std::string text = "time_s,T_1_degC,T_2_degC,T_3_degC,T_4_degC,T_5_degC,T_6_degC,T_7_degC,T_8_degC\n";
  text.reserve(kRows * 80);
  for (std::size_t i = 0; i < kRows; ++i) {
    text += fixed_text(static_cast<double>(i) / 30.0, 3);
    for (std::size_t k = 0; k < 8; ++k)
      text += "," + fixed_text(20.0 + static_cast<double>((i * (k + 7)) % 9973) * 1e-3, 3);
    text += '\n';
  }
  return text;
}

void thermal_log_of_a_day(benchmark::State& state) {
  const std::string text = day_text();
  for (auto _ : state) {
    Diagnostics diagnostics;
    const auto log = thermal::parse_log(text, "day.csv", diagnostics);
    if (!log || log->runs.size() != 1 || log->runs[0].rows() != kRows) {
      state.SkipWithError("the log was not read");
      return;
    }
    benchmark::DoNotOptimize(log->runs[0].temperature_degC[7][12345]);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kRows));
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(text.size()));
}

BENCHMARK(thermal_log_of_a_day)->Unit(benchmark::kSecond);

}  // namespace

BENCHMARK_MAIN();
