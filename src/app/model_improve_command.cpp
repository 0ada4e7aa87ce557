#include <filesystem>
#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/diagnosis/improve.hpp"
#include "trunnion/effects/model_paths.hpp"
#include "trunnion/report/diagnosis_json.hpp"
#include "trunnion/report/model_page.hpp"

#include "app/model_inputs.hpp"
#include "app/progress.hpp"

namespace trunnion::app {
namespace {

constexpr std::size_t kMostSteps = 12;  // a model that lacks more is better fitted whole

std::string line(const diagnosis::ImproveStep& step, std::size_t k) {
  std::string out = "step " + std::to_string(k) + ": " + report::error_text(step.error) + "; " +
                    std::string(text_of(step.diagnosis.verdict));
  for (std::size_t i = 0; i < step.diagnosis.effects.size(); ++i)
    out += (i == 0 ? ": " : " + ") + step.diagnosis.effects[i];
  return out + "\n";
}

int run(const ModelFiles& files, const std::string& folder, const std::string& also) {
  int exit = kDone;
  if (folder == "-")
    return print_error({ErrorCode::wrong_use, "-o names the folder of the model files, not '-'", {}, {}});
  const auto in = read_inputs(files, exit);
  if (!in) return exit;
  const auto extra = read_competing(also, in->machine, in->model.context, exit);
  if (!extra) return exit;
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return print_error({ErrorCode::io_failed, "cannot make the folder: " + failed.message(), folder, {}});
  auto steps = [&] {
    const Activity activity("improving");
    return diagnosis::improve(in->machine, in->data, in->model, {{}, kMostSteps, *extra});
  }();
  std::string text, parent = files.model;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const std::string path =
        (std::filesystem::path(folder) / ("step_" + std::to_string(k) + ".toml")).string();
    Model model = steps[k].model;
    model.parent = parent;
    if (const ExitCode code = write_output(path, model_text(written_to(model, path))); code != kDone)
      return code;
    text += line(steps[k], k);
    parent = path;
  }
  text += steps.back().diagnosis.paragraph + "\n";
  const std::string json = report::improve_json(steps);
  const report::ModelPageInput page{&in->machine, &in->data, json, made_by()};
  return files.result.write(
      json, [&] { return report::improve_page(page, steps); }, text);
}

}  // namespace

void add_model_improve_command(CLI::App& model, int& exit) {
  auto* command =
      model.add_subcommand("improve", "diagnose, add, refit until nothing is left: one model file a step");
  auto files = std::make_shared<ModelFiles>();
  auto folder = std::make_shared<std::string>();
  auto also = std::make_shared<std::string>();
  files->add_to(*command);
  command->add_option("-o,--output", *folder, "folder for the model files")->required();
  command->add_option("--also", *also, "model file whose effects (formulas) compete with the library's");
  command->callback([files, folder, also, &exit] { exit = run(*files, *folder, *also); });
}

}  // namespace trunnion::app
