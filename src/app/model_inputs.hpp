#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/effects/model.hpp"

#include "app/results.hpp"
#include "app/support.hpp"

namespace trunnion::app {

/// The files that most `trunnion model` commands take.
struct ModelFiles {
  std::vector<std::string> data;
  std::string machine, model;
  ResultOptions result;

  /// Adds DATA..., -m, --model, --json and --report to a command.
  void add_to(CLI::App& command, bool data_required = true, bool model_required = true);
};

/// What those files hold; `model` knows the sensors and runs of `data`.
struct ModelInputs {
  Machine machine;
  diagnosis::Dataset data;
  Model model;
};

/// Reads them; messages are printed, and nothing comes back when one is an error (`exit` is set).
std::optional<ModelInputs> read_inputs(const ModelFiles& files, int& exit);
std::optional<Machine> read_machine(const std::string& path, int& exit);
std::optional<Model> read_model(const std::string& path, const Machine& machine, const EffectContext& context,
                                int& exit);
std::optional<diagnosis::Dataset> read_data(const std::vector<std::string>& paths, const Machine& machine,
                                            int& exit);

/// The effects of another model file (formulas, as a rule) that compete with the library's, one family each;
/// none when `path` is empty, nothing when it cannot be read.
std::optional<std::vector<EffectFamily>> read_competing(const std::string& path, const Machine& machine,
                                                        const EffectContext& context, int& exit);

/// Members of the group `trunnion model`.
void add_model_evaluate_command(CLI::App& model, int& exit);
void add_model_fit_command(CLI::App& model, int& exit);
void add_model_diagnose_command(CLI::App& model, int& exit);
void add_model_add_command(CLI::App& model, int& exit);
void add_model_plan_command(CLI::App& model, int& exit);
void add_model_improve_command(CLI::App& model, int& exit);
void add_model_history_command(CLI::App& model, int& exit);

}  // namespace trunnion::app
