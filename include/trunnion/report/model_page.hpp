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

/// The verdict as a story: residual before and after what was named, the ranking, who is whose rival, the
/// error budget, the next measurement. Refits the model with the named effects.
Page diagnosis_page(const ModelPageInput& input, const diagnosis::Diagnosis& result);

/// How the error fell, model by model; `input.data` may be absent.
Page history_page(const ModelPageInput& input, const std::vector<diagnosis::HistoryEntry>& entries);

}  // namespace trunnion::report
