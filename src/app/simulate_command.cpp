#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/diagnosis/plan.hpp"

#include "app/model_inputs.hpp"

namespace trunnion::app {
namespace {

struct Options {
  std::string plan, machine, truth, out;
  std::uint64_t seed = 1;
};

int run(const Options& options) {
  int exit = kDone;
  const auto machine = read_machine(options.machine, exit);
  if (!machine) return exit;
  Diagnostics diagnostics;
  const auto plan = diagnosis::load_plan(options.plan, *machine, diagnostics);
  if (!plan) return print_failure(diagnostics, plan.error());
  auto data = diagnosis::expand(plan->runs, *machine);
  if (!data) {
    Error error = data.error();
    error.file = options.plan;
    return print_error(error);
  }
  const auto truth = read_model(options.truth, *machine, data->context, exit);
  if (!truth) return exit;
  diagnosis::simulate(*data, *plan, *machine, *truth, options.seed);
  exit =
      write_output(options.out, diagnosis::measurements_text(*data, *machine,
                                                             {" virtual measurements of '" + machine->name +
                                                              "', seed " + std::to_string(options.seed)}));
  double minutes = 0.0;
  for (const auto& run : plan->runs) minutes += run.minutes;
  if (exit == kDone)
    spdlog::info("{} readings in {} runs, {} min of machine time", data->readings.size(), plan->runs.size(),
                 minutes);
  return exit;
}

}  // namespace

void add_simulate_command(CLI::App& root, int& exit) {
  auto* command =
      root.add_subcommand("simulate", "virtual measurements: what a machine with known errors would show");
  auto options = std::make_shared<Options>();
  command->add_option("plan", options->plan, "plan file (TOML)")->required();
  command->add_option("-m,--machine", options->machine, "machine file (TOML)")->required();
  command->add_option("--truth", options->truth, "model file of the true errors")->required();
  command->add_option("-o,--output", options->out, "measurement file to write")->required();
  command->add_option("--seed", options->seed, "of the noise; the same seed gives the same file");
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trunnion::app
