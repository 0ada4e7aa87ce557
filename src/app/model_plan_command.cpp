#include <memory>

#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/report/diagnosis_json.hpp"

#include "app/model_inputs.hpp"
#include "app/progress.hpp"

namespace trunnion::app {

void add_model_plan_command(CLI::App& model, int& exit) {
  auto* command = model.add_subcommand(
      "plan", "the next measurement: the runs that separate the candidate effects, with their minutes");
  auto files = std::make_shared<ModelFiles>();
  auto out = std::make_shared<std::string>();
  files->add_to(*command);
  command->add_option("-o,--output", *out, "write the runs as a plan file");
  command->callback([files, out, &exit] {
    const auto in = read_inputs(*files, exit);
    if (!in) return;
    const auto result = [&] {
      const Activity activity("planning");
      return diagnosis::diagnose(in->machine, in->data, in->model);
    }();
    if (result.next && !out->empty()) {
      config::Array runs;
      for (const auto& run : result.next->runs) runs.push_back({plan_run_table(run, in->machine), {}});
      exit = write_output(*out, config::toml_text({config::Table{{"run", {std::move(runs), {}}}}, {}}));
      if (exit != kDone) return;
    }
    const std::string said = what_next(result);
    const std::string json = report::plan_json(result, in->machine);
    const auto page = [&] {
      return report::plan_page(in->machine,
                               result.next ? result.next->runs : std::vector<diagnosis::PlanRun>{},
                               {"The next measurement", said, json, made_by()});
    };
    exit = files->result.write(json, page, *out == "-" ? "" : said + "\n");
  });
}

}  // namespace trunnion::app
