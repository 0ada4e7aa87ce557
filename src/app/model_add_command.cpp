#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/diagnosis/improve.hpp"
#include "trunnion/effects/model_paths.hpp"
#include "trunnion/report/diagnosis_json.hpp"
#include "trunnion/report/model_page.hpp"

#include "app/command_tree.hpp"
#include "app/model_inputs.hpp"
#include "app/progress.hpp"

namespace trunnion::app {
namespace {

struct ModelAddOptions {
  ModelFiles files;
  std::string effect, out, also;
  std::vector<std::string> with;  // key=value of a variant
};

std::optional<std::vector<std::pair<std::string, std::string>>> variant(
    const std::vector<std::string>& with) {
  std::vector<std::pair<std::string, std::string>> out;
  for (const std::string& item : with) {
    const auto at = item.find('=');
    if (at == std::string::npos || at == 0) {
      spdlog::error("error: --with wants key=value (component=EZX, sensor=frame, run=r3), not '{}'", item);
      return std::nullopt;
    }
    out.emplace_back(item.substr(0, at), item.substr(at + 1));
  }
  return out;
}

// Where the effect has variants and none is asked for, the data choose.
Result<std::shared_ptr<const Effect>> chosen(const ModelAddOptions& options, const Machine& machine,
                                             Model& model, const diagnosis::Diagnosis* diagnosis,
                                             const std::vector<std::pair<std::string, std::string>>& keys,
                                             const std::vector<EffectFamily>& own) {
  for (const EffectFamily& family : own)
    if (family.id() == options.effect) return family.variants.front();
  if (keys.empty() && diagnosis != nullptr) {
    for (const auto& ranked : diagnosis->ranking)
      if (ranked.id == options.effect)
        return make_effect(machine, model.context, options.effect, ranked.variant);
  }
  return make_effect(machine, model.context, options.effect, keys);
}

// A second one would be told apart from the first by nothing, and the model could not be read again. A table
// of the same component has no parameters, and may stand beside it.
const ModelEffect* already_in(const Model& model, const Effect& effect) {
  const EffectInfo& info = effect.info();
  for (const ModelEffect& entry : model.effects) {
    const EffectInfo& there = entry.effect->info();
    if (there.id == info.id && there.variant == info.variant &&
        there.parameters.size() == info.parameters.size())
      return &entry;
  }
  return nullptr;
}

int run(const ModelAddOptions& options) {
  int exit = kDone;
  const auto keys = variant(options.with);
  if (!keys) return kWrongUse;
  if (options.files.machine.empty()) {
    spdlog::error("error: model add needs the machine file (-m): effects are those of a machine's axes");
    return kWrongUse;
  }
  const auto machine = read_machine(options.files.machine, exit);
  if (!machine) return exit;
  std::optional<diagnosis::Dataset> data;
  if (!options.files.data.empty()) {
    data = read_data(options.files.data, *machine, exit);
    if (!data) return exit;
  }
  auto model = read_model(options.files.model, *machine, data ? data->context : EffectContext{}, exit);
  if (!model) return exit;
  const auto own = read_competing(options.also, *machine, model->context, exit);
  if (!own) return exit;
  std::optional<diagnosis::Diagnosis> diagnosis;
  if (data) diagnosis = diagnosis::diagnose(*machine, *data, *model, {.plan = false}, *own);
  auto effect = chosen(options, *machine, *model, diagnosis ? &*diagnosis : nullptr, *keys, *own);
  if (!effect) return print_error(effect.error());
  if (const ModelEffect* there = already_in(*model, **effect)) {
    spdlog::error("error: '{}' is in {} already{}: `model fit` fits it", options.effect, options.files.model,
                  there->where.line > 0 ? ", line " + std::to_string(there->where.line) : "");
    return kWrongUse;
  }
  Model added = *model;
  std::string json;
  std::string text;
  std::optional<diagnosis::Fit> fitted;
  if (data) {
    auto result = [&] {
      const Activity activity("adding");
      return diagnosis::add_and_fit(*machine, *data, *model, {model_effect(*effect)}, &*diagnosis);
    }();
    added = std::move(result.model);
    json = report::fit_json(result.fit, *data);
    text = options.out == "-" ? "" : report::fit_text(result.fit);
    fitted = std::move(result.fit);
  } else {
    added.effects.push_back(model_effect(*effect));
    json = report::model_json(added);
  }
  added.parent = options.files.model;
  if (const auto code = write_output(options.out, model_text(written_to(added, options.out))); code != kDone)
    return code;
  const std::string title = options.effect + " added to " + options.files.model;
  const auto page = [&] {
    if (!fitted) return report::bare_model_page({&*machine, nullptr, json, made_by()}, added, title);
    report::Page out = report::fit_page({&*machine, &*data, json, made_by()}, *fitted);
    out.title = title;
    return out;
  };
  return options.files.result.write(json, page, text);
}

}  // namespace

void add_model_add_command(CLI::App& model, int& exit) {
  auto* command = model.add_subcommand("add", "add an effect to a model, and fit it if data are given");
  auto options = std::make_shared<ModelAddOptions>();
  command
      ->add_option("effect", options->effect,
                   "identifier, as in location:C (`trunnion model effects` lists them)")
      ->type_name(kEffectName)
      ->required();
  options->files.add_to(*command, false);
  command->add_option("--with", options->with, "choice of the effect: component=EZX, sensor=frame, run=r3");
  command->add_option("--also", options->also, "model file whose effects (formulas) may be added too");
  command->add_option("-o,--output", options->out, "the new model file")->required();
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trunnion::app
