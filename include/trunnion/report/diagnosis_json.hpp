#pragma once
#include <string>

#include "trunnion/diagnosis/evaluate.hpp"
#include "trunnion/diagnosis/improve.hpp"
#include "trunnion/diagnosis/plan.hpp"

namespace trunnion::report {

/// Results of `model ...` as one JSON object each (fields: README, "Results").
std::string diagnosis_json(const diagnosis::Diagnosis& result, const Machine& machine);
std::string evaluation_json(const diagnosis::Evaluation& result, const Machine& machine);
std::string fit_json(const diagnosis::Fit& result, const diagnosis::Dataset& data);
/// The next measurement; no runs where the verdict needs none.
std::string plan_json(const diagnosis::Diagnosis& diagnosis, const Machine& machine);
/// A model as it stands: its effects with parameters in the units of their keys.
std::string model_json(const Model& model);
std::string improve_json(const std::vector<diagnosis::ImproveStep>& steps);
std::string history_json(const std::vector<diagnosis::HistoryEntry>& entries);

/// What an import has made of `file`: {"file", "columns", "rows", "ranges"} of the measurement file's text.
std::string imported_json(const std::string& file, const std::string& measurements);

/// The same for a person.
std::string diagnosis_text(const diagnosis::Diagnosis& result);
std::string evaluation_text(const diagnosis::Evaluation& result);
std::string fit_text(const diagnosis::Fit& result);
/// One line: residual, held-out residual and noise of each quantity, chi-square.
std::string error_text(const diagnosis::HistoryEntry& entry);

/// What `simulate` has made, for a person and as JSON.
struct SimulationSummary {
  std::string text;
  std::string json;
};
SimulationSummary summary_of(const diagnosis::Dataset& data, const diagnosis::Plan& plan, std::uint64_t seed);

}  // namespace trunnion::report
