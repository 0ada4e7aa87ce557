#include "app/model_inputs.hpp"
#include "app/support.hpp"

namespace trunnion::app {

// The group `trunnion model ...`: what is known of a machine's errors, against measurements. Each member has
// its own file.
void add_model_command(CLI::App& root, int& exit) {
  auto* model = root.add_subcommand(
      "model", "what is known of a machine's errors: list, evaluate, fit, diagnose, improve");
  model->require_subcommand(1);
  add_model_effects_command(*model, exit);
  add_model_evaluate_command(*model, exit);
  add_model_fit_command(*model, exit);
  add_model_diagnose_command(*model, exit);
  add_model_add_command(*model, exit);
  add_model_plan_command(*model, exit);
  add_model_improve_command(*model, exit);
  add_model_history_command(*model, exit);
}

}  // namespace trunnion::app
