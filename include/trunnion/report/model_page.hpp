#pragma once
#include <string>
#include <vector>

#include "trunnion/diagnosis/evaluate.hpp"
#include "trunnion/diagnosis/improve.hpp"
#include "trunnion/report/page.hpp"

namespace trunnion::report {

/// What the pages of `trunnion model` have in common.
struct ModelPageInput {
  const Machine* machine = nullptr;
  const diagnosis::Dataset* data = nullptr;
  std::string result_json;
  std::string made_by;
};

/// The residual of a model as it stands: in space, by run, against what was measured at, against a normal
/// distribution.
Page evaluation_page(const ModelPageInput& input, const Model& model, const diagnosis::Evaluation& result);

/// `model fit`: whether the readings are met within their uncertainty, the parameters with their sigmas, what
/// each effect does, and the residual.
Page fit_page(const ModelPageInput& input, const diagnosis::Fit& fit);

/// `model add` without data: the effects of the model. `input.data` is absent.
Page bare_model_page(const ModelPageInput& input, const Model& model, const std::string& title);

/// The verdict as a story: one sentence with the detection limits, held-out error by step, residual before
/// and after what was named, what it depends on, the model with its error budget, the candidates and who is
/// whose rival, the next measurement. Refits the model with the named effects.
Page diagnosis_page(const ModelPageInput& input, const diagnosis::Diagnosis& result);

/// How the error fell, model by model, step by step: what was added, the residual vectors, the error.
/// `input.data` may be absent; `models` are those of the entries.
Page history_page(const ModelPageInput& input, const std::vector<diagnosis::HistoryEntry>& entries,
                  const std::vector<Model>& models);

/// `model improve` as a story, step by step: what was said, what was added, the residual vectors at one
/// scale, the error that falls; then the last model and what its residual depends on. Requires a step.
Page improve_page(const ModelPageInput& input, const std::vector<diagnosis::ImproveStep>& steps);

/// Virtual measurements: the readings in space, by run, against what was measured at, and which effect of
/// the truth makes how much of them. `verdict` says how many there are.
Page simulation_page(const ModelPageInput& input, const Model& truth, const std::string& verdict);

}  // namespace trunnion::report
