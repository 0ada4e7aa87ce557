#include <memory>

#include "trunnion/diagnosis/evaluate.hpp"
#include "trunnion/report/diagnosis_json.hpp"
#include "trunnion/report/model_page.hpp"

#include "app/model_inputs.hpp"
#include "app/progress.hpp"

namespace trunnion::app {

void add_model_evaluate_command(CLI::App& model, int& exit) {
  auto* command = model.add_subcommand("evaluate", "how well a model as it stands explains measurements");
  auto files = std::make_shared<ModelFiles>();
  files->add_to(*command);
  command->callback([files, &exit] {
    const auto in = read_inputs(*files, exit);
    if (!in) return;
    const auto result = [&] {
      const Activity activity("evaluating");
      return diagnosis::evaluate(in->machine, in->data, in->model);
    }();
    const std::string json = report::evaluation_json(result, in->machine);
    const report::ModelPageInput page{&in->machine, &in->data, json, made_by()};
    exit = files->result.write(
        json, [&] { return report::evaluation_page(page, in->model, result); },
        report::evaluation_text(result));
  });
}

}  // namespace trunnion::app
