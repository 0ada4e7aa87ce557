// Time of the CL reader for each record. Lines as an impeller path has them: four decimals of mm, seven of
// the axis.
#include <benchmark/benchmark.h>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "trunnion/cl/reader.hpp"

namespace {

using namespace trunnion;

constexpr int kPoints = 200000;

std::string points_text(const char* format) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::string text = "UNITS/MM\nFEDRAT/1000,MMPM\n";
  for (int i = 0; i < kPoints; ++i) {
    const Vec3 axis = Vec3(unit(random), unit(random), 1.5 + unit(random)).normalized();
    char line[200];
    const int length = std::snprintf(line, sizeof(line), format, 150.0 * unit(random), 150.0 * unit(random),
                                     80.0 * unit(random), axis.x(), axis.y(), axis.z());
    text.append(line, static_cast<std::size_t>(length));
  }
  return text;
}

void read_all(benchmark::State& state, const std::string& text) {
  for (auto _ : state) {
    Diagnostics diagnostics;
    cl::Reader reader(text, "bench", {}, diagnostics);
    cl::Record record;
    double sum = 0.0;
    while (reader.next(record)) {
      if (const auto* motion = std::get_if<cl::Motion>(&record.data))
        sum += motion->tip_P.x() + motion->axis_P.z();
    }
    benchmark::DoNotOptimize(sum);
    if (diagnostics.has_errors()) state.SkipWithError("the text has errors");
  }
  state.SetItemsProcessed(state.iterations() * kPoints);
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(text.size()));
}

void cl_plain(benchmark::State& state) {
  read_all(state, points_text("GOTO/%.4f,%.4f,%.4f,%.7f,%.7f,%.7f\n"));
}
void cl_continued(benchmark::State& state) {
  read_all(state, points_text("GOTO / %.10f, %.10f, %.10f,  $\n%.10f, %.10f, %.10f\n"));
}
void cl_word_by_word(benchmark::State& state) {
  read_all(state, points_text("GO TO/%.4f,%.4f,%.4f,%.7f,%.7f,%.7f\n"));
}

// The six numbers alone, by the library's own from_chars: what a reader without a fast path pays.
void cl_from_chars_only(benchmark::State& state) {
  const std::string text = points_text("GOTO/%.4f,%.4f,%.4f,%.7f,%.7f,%.7f\n");
  for (auto _ : state) {
    double sum = 0.0;
    const char* p = text.data();
    const char* const end = p + text.size();
    while (p < end) {
      double value = 0.0;
      const auto parsed = std::from_chars(p, end, value);
      if (parsed.ec == std::errc{}) sum += value;
      p = parsed.ptr + 1;
    }
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(state.iterations() * kPoints);
}

BENCHMARK(cl_plain)->Unit(benchmark::kMillisecond);
BENCHMARK(cl_continued)->Unit(benchmark::kMillisecond);
BENCHMARK(cl_word_by_word)->Unit(benchmark::kMillisecond);
BENCHMARK(cl_from_chars_only)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
