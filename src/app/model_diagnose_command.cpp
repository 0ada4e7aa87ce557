#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/effects/model_paths.hpp"
#include "trunnion/report/diagnosis_json.hpp"
#include "trunnion/report/model_page.hpp"

#include "app/file_roles.hpp"
#include "app/model_inputs.hpp"
#include "app/progress.hpp"

namespace trunnion::app {

void add_model_diagnose_command(CLI::App& model, int& exit) {
  auto* command =
      model.add_subcommand("diagnose", "which effect the model lacks, or that these data cannot tell");
  auto files = std::make_shared<ModelFiles>();
  auto also = std::make_shared<std::string>();
  auto formula = std::make_shared<std::string>();
  files->add_to(*command);
  command->add_option("--also", *also, "model file whose effects (formulas) compete with the library's");
  command
      ->add_option(
          "--formula", *formula,
          "write a formula fitted to the residual that no effect of the library explains, as a model file")
      ->type_name(kFileToWrite);
  command->callback([files, also, formula, &exit] {
    const auto in = read_inputs(*files, exit);
    if (!in) return;
    const auto extra = read_competing(*also, in->machine, in->model.context, exit);
    if (!extra) return;
    const auto result = [&] {
      const Activity activity("diagnosing");
      return diagnosis::diagnose(in->machine, in->data, in->model, {}, *extra);
    }();
    if (!formula->empty()) {
      if (result.formula)
        exit = write_output(*formula, model_text(written_to(result.formula->alone, *formula)));
      else
        spdlog::warn("warning: no formula is proposed for the verdict '{}': {} is not written",
                     diagnosis::text_of(result.verdict), *formula);
      if (exit != kDone) return;
    }
    const std::string json = report::diagnosis_json(result, in->machine);
    const report::ModelPageInput page{&in->machine, &in->data, json, made_by()};
    exit = files->result.write(
        json, [&] { return report::diagnosis_page(page, result); }, report::diagnosis_text(result));
  });
}

}  // namespace trunnion::app
