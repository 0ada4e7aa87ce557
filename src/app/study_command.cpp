#include <memory>

#include "trunnion/path/study.hpp"
#include "trunnion/report/study_json.hpp"
#include "trunnion/report/study_page.hpp"

#include "app/options.hpp"
#include "app/progress.hpp"

namespace trunnion::app {
namespace {

struct StudyCommand {
  std::string cl_file;
  MachineOptions machine;
  std::vector<double> tolerances_mm;
  std::optional<double> axis_tolerance_deg;
  double flute_mm = 0.0;
  int listed = 50;
  ResultOptions result;
  ClCliOptions reading;
};

ExitCode run(const StudyCommand& command) {
  Diagnostics diagnostics;
  const auto machine = load(command.machine, diagnostics);
  if (!machine) return print_failure(diagnostics, machine.error());
  const auto program = cl::load_program(command.cl_file, command.reading.resolve(), diagnostics);
  if (!program) return print_failure(diagnostics, program.error());
  const auto runs = path::study_runs(*machine, machine->tool_vector(), *program);
  if (!runs) return print_failure(diagnostics, runs.error());
  if (runs->empty()) {
    return print_failure(
        diagnostics,
        Error{ErrorCode::wrong_input, "a path of one point has no segment to study", command.cl_file, {}});
  }
  print(diagnostics);
  path::StudyOptions options;
  if (!command.tolerances_mm.empty()) options.tolerances_mm = command.tolerances_mm;
  options.flute_mm = command.flute_mm;
  options.axis_tolerance =
      command.axis_tolerance_deg ? Angle::degrees(*command.axis_tolerance_deg) : machine->axis_tolerance;
  options.listed = static_cast<std::size_t>(command.listed);
  const auto result = [&] {
    const Activity activity("studying");
    return path::study_nonlinear(*machine, machine->tool_vector(), *runs, options);
  }();
  return command.result.write(
      report::study_json(result), [&] { return report::study_page(result, command.cl_file, made_by()); },
      report::study_text(result));
}

}  // namespace

void add_study_command(CLI::App& root, int& exit) {
  auto* study = root.add_subcommand("study", "what the methods do on a CL file");
  study->require_subcommand(1);
  auto command = std::make_shared<StudyCommand>();
  CLI::App* c = study->add_subcommand(
      "nonlinear",
      "predictors of the nonlinear error against the truth; points and proved error by placement");
  c->add_option("part", command->cl_file, "CL file (- is standard input)")->required();
  command->machine.add_to(*c, false);
  c->add_option("--tolerance-mm", command->tolerances_mm,
                "tolerances to compare (default: 0.01 0.005 0.002 0.001 0.0005)")
      ->check(above_zero())
      ->delimiter(',');
  c->add_option("--flute-length-mm", command->flute_mm,
                "hold the tolerances for every point of the tool from its tip to this length along its axis "
                "(0: for the tip alone)")
      ->check(CLI::Range(0.0, 1000.0));
  c->add_option("--axis-tolerance-deg", command->axis_tolerance_deg,
                "largest angle of the tool axis off the shortest turn between two CL directions (default: "
                "axis_tolerance_deg of the machine file)")
      ->check(above_zero());
  c->add_option("--list", command->listed, "segments to list, largest error first")
      ->check(between(0.0, kLargestOption))
      ->capture_default_str();
  command->result.add_to(*c);
  command->reading.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace trunnion::app
