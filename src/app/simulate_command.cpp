#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/diagnosis/plan.hpp"
#include "trunnion/report/diagnosis_json.hpp"
#include "trunnion/report/model_page.hpp"

#include "app/command_tree.hpp"
#include "app/model_inputs.hpp"
#include "app/progress.hpp"
#include "app/results.hpp"

namespace trunnion::app {
namespace {

struct SimulateFlags {
  std::string plan, machine, truth, out;
  ResultOptions result;
  std::uint64_t seed = 1;
};

int run(const SimulateFlags& options) {
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
  {
    const Activity activity("simulating");
    diagnosis::simulate(*data, *plan, *machine, *truth, options.seed);
  }
  exit =
      write_output(options.out, diagnosis::measurements_text(*data, *machine,
                                                             {" virtual measurements of '" + machine->name +
                                                              "', seed " + std::to_string(options.seed)}));
  if (exit != kDone) return exit;
  const auto summary = report::summary_of(*data, *plan, options.seed);
  spdlog::info("{}", summary.text);
  return options.result.write(summary.json, [&] {
    return report::simulation_page({&*machine, &*data, summary.json, made_by()}, *truth, summary.text);
  });
}

}  // namespace

void add_simulate_command(CLI::App& root, int& exit) {
  auto* command =
      root.add_subcommand("simulate", "virtual measurements: the readings of a machine with known errors");
  auto options = std::make_shared<SimulateFlags>();
  command->add_option("plan", options->plan, "plan file (TOML)")->required();
  command
      ->add_option("-m,--machine", options->machine,
                   "machine file, or the name of one in postconfigs/machines")
      ->type_name(kMachineName)
      ->required();
  command->add_option("--truth", options->truth, "model file of the true errors")->required();
  command->add_option("-o,--output", options->out, "measurement file to write")->required();
  command->add_option("--seed", options->seed, "random seed of the noise; the same seed gives the same file")
      ->capture_default_str();
  options->result.add_to(*command);
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trunnion::app
