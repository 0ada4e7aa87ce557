#include <memory>

#include "trunnion/report/compare.hpp"
#include "trunnion/report/nc_page.hpp"

#include "app/against_options.hpp"
#include "app/options.hpp"
#include "app/progress.hpp"

namespace trunnion::app {
namespace {

struct CompareCommand {
  std::vector<std::string> programs;
  AgainstOptions against;
  std::string truth;
  MachineOptions machine;
  ResultOptions result;
  double tolerance_mm = 0.01;
  ToolCliOptions tools;
};

Result<report::ComparedProgram> evaluate(const CompareCommand& command, const std::string& program,
                                         const Machine& machine, const nc::Controller& controller,
                                         const post::VerifyOptions& options, Diagnostics& diagnostics) {
  auto path = command.against.open();
  if (!path) return tl::unexpected(path.error());
  auto nc = cl::open_source(program);
  if (!nc) return tl::unexpected(nc.error());
  auto report = [&] {
    const Activity activity("verifying");
    return post::verify(std::move(*path), {std::move(*nc), program}, {machine, controller, options},
                        diagnostics);
  }();
  if (!report) return tl::unexpected(report.error());
  return report::ComparedProgram{program, std::move(*report)};
}

ExitCode run(CompareCommand& command) {
  Diagnostics diagnostics;
  const auto files = load_with_controller(command.machine, diagnostics);
  if (!files) return print_failure(diagnostics, files.error());
  const Machine& machine = files->machine;
  const nc::Controller& controller = files->controller;
  if (const auto loaded = command.against.load(command.machine, diagnostics); !loaded)
    return print_failure(diagnostics, loaded.error());
  post::VerifyOptions options;
  const auto truth = load_truth(command.truth, machine, options.lag_s, diagnostics);
  if (!truth) return print_failure(diagnostics, truth.error());
  const auto tools = command.tools.load(diagnostics);
  if (!tools) return print_failure(diagnostics, tools.error());
  const auto bodies = command.result.bodies_of(machine, diagnostics);
  if (!bodies) return print_failure(diagnostics, bodies.error());
  options.tolerance_mm = command.tolerance_mm;
  options.axis_tolerance = machine.axis_tolerance;
  options.truth = *truth ? &**truth : nullptr;
  options.tools = command.tools.resolve(*tools);
  options.collect = true;
  std::vector<report::ComparedProgram> programs;
  for (const std::string& program : command.programs) {
    auto evaluated = evaluate(command, program, machine, controller, options, diagnostics);
    if (!evaluated) return print_failure(diagnostics, evaluated.error());
    programs.push_back(std::move(*evaluated));
  }
  print(diagnostics);
  const std::string json = report::compare_json(programs);
  return command.result.write(
      json,
      [&] {
        report::ComparePageInput input{programs, machine, command.against.file, json, made_by()};
        input.nc_text = text_of_file(command.programs.front());
        input.bodies = *bodies;
        input.cl_text = text_of_file(command.against.file);
        return report::compare_page(input);
      },
      report::compare_table(programs));
}

}  // namespace

void add_compare_command(CLI::App& root, int& exit) {
  auto command = std::make_shared<CompareCommand>();
  CLI::App* c = root.add_subcommand(
      "compare", "NC programs of one part side by side, on the nominal machine or one with errors");
  c->add_option("programs", command->programs, "NC files")->required();
  command->against.add_to(*c)->required();
  command->machine.add_to(*c, true);
  c->add_option("--truth", command->truth,
                "model of the errors of the machine to evaluate on (default: the nominal machine)");
  c->add_option("--tolerance-mm", command->tolerance_mm, "largest deviation of the tip from the CL path")
      ->check(above_zero())
      ->capture_default_str();
  command->tools.add_to(*c);
  command->result.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace trunnion::app
