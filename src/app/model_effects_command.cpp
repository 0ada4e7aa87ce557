#include <algorithm>
#include <memory>
#include <optional>

#include "trunnion/base/nearest_name.hpp"
#include "trunnion/effects/library.hpp"
#include "trunnion/report/command_pages.hpp"
#include "trunnion/report/effects_report.hpp"

#include "app/command_tree.hpp"
#include "app/options.hpp"
#include "app/support.hpp"

namespace trunnion::app {
namespace {

struct ModelEffectsOptions {
  std::optional<std::string> machine;
  std::vector<std::string> only;
  ResultOptions result;
};

// The A-C trunnion that is meant where no machine is named.
constexpr const char* kTrunnion = R"([machine]
name = "A-C trunnion"
[[axis]]
name = "X"
type = "linear"
direction = [1, 0, 0]
min_mm = -300
max_mm = 300
[[axis]]
name = "Y"
type = "linear"
direction = [0, 1, 0]
min_mm = -300
max_mm = 300
[[axis]]
name = "Z"
type = "linear"
direction = [0, 0, 1]
min_mm = -200
max_mm = 300
[[axis]]
name = "A"
type = "rotary"
direction = [1, 0, 0]
point_mm = [0, 0, -200]
min_deg = -120
max_deg = 120
[[axis]]
name = "C"
type = "rotary"
direction = [0, 0, 1]
point_mm = [0, 0, -200]
cyclic = true
[chain]
tool = ["X", "Y", "Z"]
part = ["A", "C"]
)";

Result<Machine> machine_of(const ModelEffectsOptions& options, Diagnostics& diagnostics) {
  return options.machine ? load_machine_or_named(*options.machine, diagnostics)
                         : parse_machine(kTrunnion, "(built in)", diagnostics);
}

// Every linear axis and the room have a sensor, and there is a run, so that no effect is left out for want of
// data.
EffectContext context_of(Machine& machine) {
  EffectContext context;
  context.names.temperatures.push_back(machine.sensors.ambient);
  for (const Axis& axis : machine.axes) {
    if (axis.kind != AxisKind::linear) continue;
    const auto [sensor, added] = machine.sensors.axes.try_emplace(axis.name, "screw_" + axis.name);
    context.names.temperatures.push_back(sensor->second);
  }
  context.runs.push_back({"run", 3600.0});
  return context;
}

ExitCode run(const ModelEffectsOptions& options) {
  Diagnostics diagnostics;
  auto machine = machine_of(options, diagnostics);
  if (!machine) return print_failure(diagnostics, machine.error());
  print(diagnostics);
  const EffectContext context = context_of(*machine);
  auto library = effect_library(*machine, context);
  if (!options.only.empty()) {
    std::vector<std::string> all;
    all.reserve(library.size());
    for (const EffectFamily& family : library) all.push_back(family.id());
    std::erase_if(library, [&](const EffectFamily& f) {
      const std::string kind = f.id().substr(0, f.id().find(':'));
      return std::none_of(options.only.begin(), options.only.end(),
                          [&](const std::string& o) { return o == f.id() || o == kind; });
    });
    if (library.empty())
      return print_error({ErrorCode::wrong_use,
                          "no such effect: " + options.only.front() +
                              did_you_mean(options.only.front(), all) + "; without a name all are listed",
                          {},
                          {}});
  }
  return options.result.write(report::effects_json(library),
                              {"Effects of " + machine->name,
                               std::to_string(library.size()) + " effects that a model may hold.",
                               {},
                               {}},
                              report::effects_page, report::effects_text(library));
}

}  // namespace

void add_model_effects_command(CLI::App& model, int& exit) {
  auto options = std::make_shared<ModelEffectsOptions>();
  auto* command = model.add_subcommand(
      "effects", "the library: what each effect is, what causes it, parameters, usual range");
  command
      ->add_option("effect", options->only,
                   "ids (location:C) or kinds (location) to show; all when none is given")
      ->type_name(kEffectName);
  command
      ->add_option("-m,--machine", options->machine,
                   "machine file, or the name of one in postconfigs/machines (default: an A-C trunnion)")
      ->type_name(kMachineName);
  options->result.add_to(*command);
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trunnion::app
