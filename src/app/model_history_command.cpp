#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/diagnosis/improve.hpp"
#include "trunnion/report/diagnosis_json.hpp"
#include "trunnion/report/model_page.hpp"

#include "app/command_tree.hpp"
#include "app/model_inputs.hpp"

namespace trunnion::app {
namespace {

struct ModelHistoryOptions {
  std::vector<std::string> files;  // models (.toml) and data
  std::string machine;
  ResultOptions result;
};

std::string effects_text(const std::vector<std::string>& items) {
  std::string out;
  for (const auto& item : items) out += (out.empty() ? "" : " + ") + item;
  return out.empty() ? "(no effect)" : out;
}

int run(const ModelHistoryOptions& options) {
  int exit = kDone;
  ModelFiles files;
  std::vector<std::string> models;
  for (const std::string& file : options.files)
    (file.ends_with(".toml") ? models : files.data).push_back(file);
  if (models.empty() || (!files.data.empty() && options.machine.empty())) {
    spdlog::error("error: model history wants model files (.toml), and with data the machine file (-m)");
    return kWrongUse;
  }
  if (options.machine.empty()) {
    spdlog::error("error: model history needs the machine file (-m): effects are those of a machine's axes");
    return kWrongUse;
  }
  const auto machine = read_machine(options.machine, exit);
  if (!machine) return exit;
  std::optional<diagnosis::Dataset> data;
  if (!files.data.empty()) {
    data = read_data(files.data, *machine, exit);
    if (!data) return exit;
  }
  std::vector<diagnosis::HistoryEntry> entries;
  std::vector<Model> shown;
  std::string text;
  for (const std::string& path : models) {
    const auto model = read_model(path, *machine, data ? data->context : EffectContext{}, exit);
    if (!model) return exit;
    diagnosis::HistoryEntry entry;
    if (data)
      entry = diagnosis::history_entry(*machine, *data, *model);
    else {
      entry.name = model->name;
      entry.parent = model->parent.value_or("");
      for (const auto& effect : model->effects) entry.effects.push_back(effect.id());
    }
    text += path + ": ";
    if (data) text += report::error_text(entry) + "; ";
    text += effects_text(entry.effects) + "\n";
    entries.push_back(std::move(entry));
    shown.push_back(*model);
  }
  const std::string json = report::history_json(entries);
  const report::ModelPageInput page{&*machine, data ? &*data : nullptr, json, made_by()};
  return options.result.write(
      json, [&] { return report::history_page(page, entries, shown); }, text);
}

}  // namespace

void add_model_history_command(CLI::App& model, int& exit) {
  auto* command = model.add_subcommand("history", "how the error fell, model by model");
  auto options = std::make_shared<ModelHistoryOptions>();
  command
      ->add_option("files", options->files, "model files (.toml) in their order, and measurement files (CSV)")
      ->required();
  command
      ->add_option("-m,--machine", options->machine,
                   "machine file, or the name of one in postconfigs/machines")
      ->type_name(kMachineName);
  options->result.add_to(*command);
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trunnion::app
