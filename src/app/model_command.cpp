#include "app/support.hpp"

namespace trunnion::app {

// The group `trunnion model ...`: what is known of a machine's errors, against measurements. Each member has
// its own file.
void add_model_command(CLI::App& root, int& exit) {
  auto* model = root.add_subcommand(
      "model", "what is known of a machine's errors: list, evaluate, fit, diagnose, improve");
  model->require_subcommand(1);
  add_model_effects_command(*model, exit);
}

}  // namespace trunnion::app
