#include <memory>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/probe/calibration.hpp"
#include "trunnion/probe/control_numbers.hpp"
#include "trunnion/report/calibration_json.hpp"

#include "app/model_inputs.hpp"
#include "app/options.hpp"
#include "app/results.hpp"

namespace trunnion::app {
namespace {

struct CalibrateCommand {
  std::vector<std::string> data;
  std::string machine, out, parameters;
  ResultOptions result;
};

// The control whose own numbers are asked for; nothing without --parameters.
Result<std::optional<nc::Controller>> controller_of(const CalibrateCommand& command,
                                                    Diagnostics& diagnostics) {
  if (command.parameters.empty()) return std::optional<nc::Controller>{};
  const std::string folder = postconfigs_folder() + "/controllers";
  const auto file = nc::find_controller(command.parameters, folder);
  if (!file) return tl::unexpected(file.error());
  auto controller = nc::load_controller(*file, diagnostics, folder);
  if (!controller) return tl::unexpected(controller.error());
  return std::optional<nc::Controller>(std::move(*controller));
}

ExitCode run(const CalibrateCommand& command) {
  auto taken = command.data;
  taken.push_back(command.machine);
  Diagnostics diagnostics;
  const auto machine = load_machine_or_named(command.machine, diagnostics);
  if (!machine) return print_failure(diagnostics, machine.error());
  const auto text = read_file(machine->file);
  if (!text) return print_error(text.error());
  const auto data = diagnosis::load_measurements(command.data, *machine, diagnostics);
  if (!data) return print_failure(diagnostics, data.error());
  std::vector<std::string> numbers;
  const auto controller = controller_of(command, diagnostics);
  if (!controller) return print_failure(diagnostics, controller.error());
  const auto found = probe::calibrate(*machine, *data);
  if (!found) return print_failure(diagnostics, found.error());
  if (found->misfit) {
    // A machine with other errors is calibrated like this, too, and then diagnosed: the file is written.
    diagnostics.warning(
        data->files.front(), {},
        probe::misfit_text(*found) + ". Look for the cause before parts are cut with the new file" +
            (found->misfit->sigma_factor > 1.0
                 ? "; its sigmas are " + fixed_text(found->misfit->sigma_factor, 0) + " times wider for it"
                 : ""));
  }
  print(diagnostics);
  const auto calibrated = probe::machine_text_with_axes(*text, machine->file, found->machine);
  if (!calibrated) return print_error(calibrated.error());
  if (*controller) {
    auto lines = probe::control_numbers(found->machine, **controller);
    if (!lines) return print_error(lines.error());
    numbers = std::move(*lines);
  }
  // What is written must be read as what was found.
  Diagnostics again;
  if (const auto read = parse_machine(*calibrated, command.out, again); !read)
    return print_failure(again, read.error());
  if (const auto code = write_output(command.out, *calibrated); code != kDone) return code;
  return command.result.write(report::calibration_json(*found, numbers),
                              {"Rotary axes of " + machine->name, {}, {}, {}}, report::calibration_page,
                              command.out == "-" ? "" : report::calibration_text(*found, numbers));
}

}  // namespace

void add_machine_calibrate_command(CLI::App& machine, int& exit) {
  auto command = std::make_shared<CalibrateCommand>();
  CLI::App* c = machine.add_subcommand(
      "calibrate",
      "points, directions and senses of the rotary axes from measurements of balls; a new machine file");
  c->add_option("data", command->data, "measurement files (CSV), as 'trunnion probe read' writes them")
      ->required();
  c->add_option("-m,--machine", command->machine, "machine file, or the name of one in postconfigs/machines")
      ->required();
  c->add_option("-o,--output", command->out,
                "machine file to write; everything else in it is copied unchanged, comments too")
      ->required();
  c->add_option("--parameters", command->parameters,
                "print this control's own numbers, too: controller file, or the name of one in "
                "postconfigs/controllers");
  command->result.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace trunnion::app
