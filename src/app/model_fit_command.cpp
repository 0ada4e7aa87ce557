#include <memory>

#include "trunnion/diagnosis/fit.hpp"
#include "trunnion/effects/model_paths.hpp"
#include "trunnion/report/diagnosis_json.hpp"
#include "trunnion/report/model_page.hpp"

#include "app/model_inputs.hpp"
#include "app/progress.hpp"

namespace trunnion::app {

void add_model_fit_command(CLI::App& model, int& exit) {
  auto* command = model.add_subcommand("fit", "fit all parameters of a model to measurements");
  auto files = std::make_shared<ModelFiles>();
  auto out = std::make_shared<std::string>();
  auto plain = std::make_shared<bool>(false);
  files->add_to(*command);
  command->add_option("-o,--output", *out, "the fitted model file")->required();
  command->add_flag("--no-robust", *plain, "keep outliers in the fit");
  command->callback([files, out, plain, &exit] {
    const auto in = read_inputs(*files, exit);
    if (!in) return;
    auto result = [&] {
      const Activity activity("fitting");
      return diagnosis::fit(in->machine, in->data, in->model, {.robust = !*plain});
    }();
    result.model.parent = files->model;
    exit = write_output(*out, model_text(written_to(result.model, *out)));
    if (exit == kDone) {
      const std::string json = report::fit_json(result, in->data);
      const report::ModelPageInput page{&in->machine, &in->data, json, made_by()};
      exit = files->result.write(
          json, [&] { return report::fit_page(page, result); }, *out == "-" ? "" : report::fit_text(result));
    }
  });
}

}  // namespace trunnion::app
