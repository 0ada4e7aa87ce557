// Time per block of the NC writer and reader: five axis words, block number, F in every block (inverse time).
//   ./nc_bench --benchmark_repetitions=9 --benchmark_report_aggregates_only=true
#include <benchmark/benchmark.h>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "support/controllers.hpp"

namespace trunnion {
namespace {

constexpr int kBlocks = 20000;

nc::Controller controller_of(const std::string& name, bool numbered) {
  nc::Controller controller = test::shipped_controller(name);
  controller.block_numbers.enabled = numbered;
  return controller;
}

// A path like that of an impeller blade: all five axes move in every block.
std::vector<nc::Motion> motions(const nc::Controller& controller) {
  std::vector<nc::Motion> out(kBlocks);
  const auto& format = controller.numbers.axes;
  for (int i = 0; i < kBlocks; ++i) {
    const double t = 1e-3 * i;
    nc::Motion& m = out[static_cast<std::size_t>(i)];
    m.kind = nc::MotionKind::feed;
    m.feed_mode = nc::FeedMode::inverse_time;
    m.feed = 1200000 + 13 * (i % 1000);
    m.words.set(nc::AxisLetter::X, format.quanta(nc::AxisLetter::X, 80.0 * std::sin(3.0 * t) + 1e-3 * i));
    m.words.set(nc::AxisLetter::Y, format.quanta(nc::AxisLetter::Y, 60.0 * std::cos(2.0 * t) + 1e-3 * i));
    m.words.set(nc::AxisLetter::Z, format.quanta(nc::AxisLetter::Z, -40.0 + 15.0 * std::sin(t) + 1e-3 * i));
    m.words.set(nc::AxisLetter::A,
                format.quanta(nc::AxisLetter::A, -0.9 + 0.4 * std::sin(1.7 * t) + 1e-5 * i));
    m.words.set(nc::AxisLetter::C, format.quanta(nc::AxisLetter::C, 2.0 * std::cos(0.7 * t) + 1e-4 * i));
  }
  return out;
}

std::string text_of(const nc::Controller& controller, const std::vector<nc::Motion>& path) {
  std::string text;
  nc::Writer writer(controller, text);
  const auto check = [](const Result<void>& done) {
    if (!done) throw std::runtime_error(done.error().message);
  };
  check(writer.write(nc::Block(nc::ProgramStart{})));
  for (const auto& m : path) check(writer.write(m));
  check(writer.write(nc::Block(nc::ProgramEnd{})));
  return text;
}

void per_block(benchmark::State& state, std::size_t bytes) {
  state.SetItemsProcessed(state.iterations() * kBlocks);
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes));
  state.counters["ns_per_block"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kBlocks * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void write_blocks(benchmark::State& state, const std::string& name, bool numbered) {
  const auto controller = controller_of(name, numbered);
  const auto path = motions(controller);
  std::string text;
  for (auto _ : state) {
    text.clear();
    nc::Writer writer(controller, text);
    if (!writer.write(nc::Block(nc::ProgramStart{}))) throw std::runtime_error("program start");
    for (const auto& m : path) {
      if (!writer.write(m)) throw std::runtime_error("motion");
    }
    benchmark::DoNotOptimize(text.data());
  }
  per_block(state, text.size());
}

void read_blocks(benchmark::State& state, const std::string& name, bool numbered) {
  const auto controller = controller_of(name, numbered);
  const auto text = text_of(controller, motions(controller));
  std::int64_t sum = 0;
  for (auto _ : state) {
    Diagnostics diagnostics;
    nc::Reader reader(controller, "bench.nc", diagnostics, [&](const nc::Block& block) {
      if (const auto* m = std::get_if<nc::Motion>(&block)) sum += m->words[nc::AxisLetter::X];
    });
    reader.feed(text);
    if (!reader.finish()) throw std::runtime_error(diagnostics.first_error().text());
    benchmark::DoNotOptimize(sum);
  }
  per_block(state, text.size());
}

BENCHMARK_CAPTURE(write_blocks, linuxcnc_n_f, "linuxcnc", true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(write_blocks, linuxcnc_f, "linuxcnc", false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(write_blocks, fanuc_30i, "fanuc_30i", true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_blocks, linuxcnc_n_f, "linuxcnc", true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_blocks, linuxcnc_f, "linuxcnc", false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read_blocks, fanuc_30i, "fanuc_30i", true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trunnion

BENCHMARK_MAIN();
