#pragma once
#include <limits>
#include <optional>

#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/diagnosis/improve.hpp"
#include "trunnion/report/page.hpp"

/// Tables and figures of effects: parts of the model pages.
namespace trunnion::report {

/// The effects of a model: what each is, its parameters with sigma, their usual sizes, what it does to these
/// readings (rms), why it stands in the model.
Table model_table(const Machine& machine, const diagnosis::Dataset& data, const Model& model);
/// The same without data: what it is and its values.
Table model_table(const Model& model);

/// The library against the data, as a diagnosis ranked it.
Table ranking_table(const Machine& machine, const EffectContext& context, const diagnosis::Diagnosis& d);

/// Likeness of every pair of the first candidates; nothing with fewer than two.
std::optional<Figure> rivals_figure(const diagnosis::Diagnosis& d);

/// Shapley shares of the effects of a model in the mean square of what they do to the readings.
Figure budget_figure(const Machine& machine, const diagnosis::Dataset& data, const Model& model);

/// Every fitted parameter over its own standard deviation: one scale for lengths and rotations.
Figure significance_figure(const Model& model);

/// Error by step, on the data and on held-out runs, with the noise floor as a band; of the first `shown`
/// steps, on the scale of all.
Figure steps_figure(const std::vector<diagnosis::HistoryEntry>& entries,
                    std::size_t shown = std::numeric_limits<std::size_t>::max());

}  // namespace trunnion::report
