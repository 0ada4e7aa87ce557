#include "app/model_inputs.hpp"

#include <spdlog/spdlog.h>

#include "app/command_tree.hpp"
#include "app/options.hpp"

namespace trunnion::app {

void ModelFiles::add_to(CLI::App& command, bool data_required, bool model_required) {
  auto* files = command.add_option("data", data, "measurement files (CSV)");
  if (data_required) files->required();
  auto* m =
      command.add_option("-m,--machine", machine, "machine file, or the name of one in postconfigs/machines")
          ->type_name(kMachineName);
  if (data_required) m->required();
  auto* known =
      command.add_option("--model", model, "model file (TOML): what is known of the machine's errors");
  if (model_required) known->required();
  result.add_to(command);
}

std::optional<Machine> read_machine(const std::string& path, int& exit) {
  Diagnostics diagnostics;
  auto machine = load_machine_or_named(path, diagnostics);
  if (!machine) {
    exit = print_failure(diagnostics, machine.error());
    return std::nullopt;
  }
  print(diagnostics);
  return std::move(*machine);
}

std::optional<Model> read_model(const std::string& path, const Machine& machine, const EffectContext& context,
                                int& exit) {
  Diagnostics diagnostics;
  auto model = load_model(path, machine, context, diagnostics);
  if (!model) {
    exit = print_failure(diagnostics, model.error());
    return std::nullopt;
  }
  print(diagnostics);
  return std::move(*model);
}

std::optional<diagnosis::Dataset> read_data(const std::vector<std::string>& paths, const Machine& machine,
                                            int& exit) {
  Diagnostics diagnostics;
  auto data = diagnosis::load_measurements(paths, machine, diagnostics);
  if (!data) {
    exit = print_failure(diagnostics, data.error());
    return std::nullopt;
  }
  print(diagnostics);
  spdlog::debug("{} readings of {} runs, {} sensors", data->readings.size(), data->context.runs.size(),
                data->context.names.temperatures.size());
  return std::move(*data);
}

std::optional<ModelInputs> read_inputs(const ModelFiles& files, int& exit) {
  auto machine = read_machine(files.machine, exit);
  if (!machine) return std::nullopt;
  auto data = read_data(files.data, *machine, exit);
  if (!data) return std::nullopt;
  auto model = read_model(files.model, *machine, data->context, exit);
  if (!model) return std::nullopt;
  Diagnostics diagnostics;
  warn_of_missing_sensors(*model, data->context, diagnostics);
  print(diagnostics);
  return ModelInputs{std::move(*machine), std::move(*data), std::move(*model)};
}

std::optional<std::vector<EffectFamily>> read_competing(const std::string& path, const Machine& machine,
                                                        const EffectContext& context, int& exit) {
  std::vector<EffectFamily> out;
  if (path.empty()) return out;
  const auto rivals = read_model(path, machine, context, exit);
  if (!rivals) return std::nullopt;
  for (const ModelEffect& effect : rivals->effects) out.push_back({{effect.effect}});
  return out;
}

}  // namespace trunnion::app
