// Cost of the certified decision beside that of a sampled midpoint, over the cutting segments of the impeller
// sample, or of the CL file and machine file that TRUNNION_BENCH_CL and TRUNNION_BENCH_MACHINE name.
#include <benchmark/benchmark.h>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "trunnion/path/certificate.hpp"
#include "trunnion/path/study.hpp"

#include "path/bounds/closed_forms.hpp"
#include "support/folders.hpp"

namespace {

using namespace trunnion;

struct Segments {
  TableKinematics kinematics;
  std::vector<path::Station> stations;
  std::vector<std::pair<std::size_t, std::size_t>> pieces;
  std::vector<path::Reference> references;
};

std::string file_of(const char* variable, const char* otherwise) {
  const char* given = std::getenv(variable);
  return given != nullptr ? given : test::source_folder() + otherwise;
}

const Segments& impeller() {
  static const Segments segments = [] {
    Diagnostics diagnostics;
    const auto machine = load_machine(
        file_of("TRUNNION_BENCH_MACHINE", "/postconfigs/machines/trunnion_offset.toml"), diagnostics);
    const auto program =
        cl::load_program(file_of("TRUNNION_BENCH_CL", "/samples/01_impeller/impeller.cls"), {}, diagnostics);
    if (!machine || !program) throw std::runtime_error("the sample is not there");
    const auto runs = path::study_runs(*machine, machine->tool_vector(), *program);
    if (!runs) throw std::runtime_error(runs.error().text());
    Segments out{TableKinematics(*machine, machine->tool_vector()), {}, {}, {}};
    for (const path::StudyRun& run : *runs) {
      for (std::size_t i = 0; i < run.points.size(); ++i) {
        out.stations.push_back(path::station(out.kinematics, run.points[i].q));
        if (run.link || i == 0) continue;
        const path::Point& a = run.points[i - 1];
        const path::Point& b = run.points[i];
        out.pieces.emplace_back(out.stations.size() - 2, out.stations.size() - 1);
        out.references.push_back({a.tip_P, b.tip_P, a.axis_P, b.axis_P});
      }
    }
    return out;
  }();
  return segments;
}

// The usual test of a post-processor: one pose in the middle (sines and all), its distance from the chord.
void sampled_midpoint(benchmark::State& state) {
  const Segments& s = impeller();
  const double tolerance_mm = static_cast<double>(state.range(0)) * 1e-4;
  std::size_t within = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < s.pieces.size(); ++i) {
      const JointVector q =
          JointVector::interpolate(s.stations[s.pieces[i].first].q, s.stations[s.pieces[i].second].q, 0.5);
      const Vec3 tip = s.kinematics.tip_P(q, s.kinematics.sines(q));
      within += distance_to_segment(tip, s.references[i].tip0_P, s.references[i].tip1_P) <= tolerance_mm;
    }
    benchmark::DoNotOptimize(within);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.pieces.size()));
}
BENCHMARK(sampled_midpoint)->Arg(50)->Arg(20)->Arg(10)->Unit(benchmark::kMicrosecond);

// The same without a new sine: what the decision itself begins with.
void lean_midpoint(benchmark::State& state) {
  const Segments& s = impeller();
  const double tolerance_mm = static_cast<double>(state.range(0)) * 1e-4;
  std::size_t within = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < s.pieces.size(); ++i) {
      const Vec3 tip =
          path::middle_tip(s.kinematics, s.stations[s.pieces[i].first], s.stations[s.pieces[i].second]);
      within += distance_to_segment(tip, s.references[i].tip0_P, s.references[i].tip1_P) <= tolerance_mm;
    }
    benchmark::DoNotOptimize(within);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.pieces.size()));
}
BENCHMARK(lean_midpoint)->Arg(50)->Unit(benchmark::kMicrosecond);

void certified_decision(benchmark::State& state) {
  const Segments& s = impeller();
  const path::Certifier certifier(s.kinematics);
  const double tolerance_mm = static_cast<double>(state.range(0)) * 1e-4;
  std::size_t within = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < s.pieces.size(); ++i) {
      within += certifier.tip_within(s.stations[s.pieces[i].first], s.stations[s.pieces[i].second],
                                     s.references[i], tolerance_mm) == path::Within::yes;
    }
    benchmark::DoNotOptimize(within);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.pieces.size()));
}
BENCHMARK(certified_decision)->Arg(50)->Arg(20)->Arg(10)->Unit(benchmark::kMicrosecond);

void certified_bound(benchmark::State& state) {
  const Segments& s = impeller();
  const path::Certifier certifier(s.kinematics);
  double largest = 0.0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < s.pieces.size(); ++i) {
      largest = std::max(
          largest,
          certifier.tip(s.stations[s.pieces[i].first], s.stations[s.pieces[i].second], s.references[i])
              .upper);
    }
    benchmark::DoNotOptimize(largest);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.pieces.size()));
}
BENCHMARK(certified_bound)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
