#include <memory>

#include "trunnion/base/number_text.hpp"
#include "trunnion/post/program_zero.hpp"
#include "trunnion/post/proving.hpp"
#include "trunnion/report/machine_json.hpp"

#include "app/command_tree.hpp"
#include "app/options.hpp"

namespace trunnion::app {
namespace {

struct MachineCommand {
  MachineOptions machine;
  std::string program;
  ResultOptions result;
};

std::string text_of(const Machine& machine, const nc::Controller& controller) {
  std::string out = machine.name + "\n";
  const auto chain = [&](const std::vector<AxisId>& ids) {
    std::string names;
    for (const AxisId id : ids) names += (names.empty() ? "" : " ") + machine.axes[id].name;
    return names.empty() ? std::string("-") : names;
  };
  out += "from the bed to the tool: " + chain(machine.tool_chain) +
         "; from the bed to the part: " + chain(machine.part_chain) + "\n";
  out += "default gauge length " + shortest_text(machine.tool_length_mm) +
         " mm (for tools without one in a tool file or the CL file)\n";
  const auto add_zero = [&](const std::string& title, post::WordsOf words) {
    out += "\n" + title + "\n";
    const auto zero = post::program_zero(machine, controller, machine.work_offset, words);
    for (const std::string& line : post::zero_lines(zero)) out += "  " + line + "\n";
  };
  add_zero("Program zero:",
           machine.output_point == OutputPoint::tip ? post::WordsOf::tip : post::WordsOf::spindle);
  if (controller.has_tcp()) add_zero("Program zero with --rtcp:", post::WordsOf::part);
  out += "\nA positive command:\n";
  for (const post::AxisWords& axis : post::describe_axes(machine)) {
    out += "  " + axis.name + "  " + axis.motion + "\n     travel " + axis.limits + "; rapid " + axis.rapid +
           "\n";
  }
  return out;
}

ExitCode run(const MachineCommand& command) {
  Diagnostics diagnostics;
  const auto files = load_with_controller(command.machine, diagnostics);
  if (!files) return print_failure(diagnostics, files.error());
  const Machine& machine = files->machine;
  const nc::Controller& controller = files->controller;
  const auto bodies = command.result.bodies_of(machine, diagnostics);
  if (!bodies) return print_failure(diagnostics, bodies.error());
  const auto program = post::proving_program(machine, controller);
  if (!program) return print_error(program.error());
  print(diagnostics);
  if (!command.program.empty()) {
    if (const auto code = write_output(command.program, *program); code != kDone) return code;
  }
  std::string text = text_of(machine, controller);
  if (command.program.empty()) text += "\nProving program (-o FILE writes it):\n\n" + *program;
  const std::string json = report::machine_json(machine, controller, *program);
  return command.result.write(
      json,
      [&] {
        return report::machine_page(machine, *bodies, {machine.name, {}, json, made_by()});
      },
      command.program == "-" ? "" : text);
}

}  // namespace

void add_machine_command(CLI::App& root, int& exit) {
  auto command = std::make_shared<MachineCommand>();
  CLI::App* c = root.add_subcommand(
      "machine",
      "which way each axis goes, limits, and a proving program; check a machine file, make a new one");
  c->add_option("machine", command->machine.machine,
                "machine file, or the name of one in postconfigs/machines")
      ->type_name(kMachineName);
  c->add_option("-c,--controller", command->machine.controller, "controller of the proving program")
      ->type_name(kControllerName);
  c->add_option("-o,--output", command->program, "write the proving program to this file");
  command->result.add_to(*c);
  add_machine_check_command(*c, exit);
  add_machine_new_command(*c, exit);
  add_machine_calibrate_command(*c, exit);
  c->callback([command, c, &exit] {
    if (!c->get_subcommands().empty()) return;
    if (command->machine.machine.empty()) throw CLI::RequiredError("machine");
    exit = run(*command);
  });
}

}  // namespace trunnion::app
