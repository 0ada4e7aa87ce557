#include "app/thermal_warnings.hpp"

#include <algorithm>

#include "trunnion/base/number_text.hpp"
#include "trunnion/thermal/swapped.hpp"

namespace trunnion::app {
namespace {

using namespace thermal;

// One line for each run and channel whose model had to do without the speed or feed that it needs.
void tell_unknown_inputs(const ThermalModel& model, const RunPrediction& run, const std::string& file,
                         Diagnostics& diagnostics) {
  for (std::size_t c = 0; c < model.channels.size(); ++c) {
    const auto rows = std::count_if(run.channel[c].begin(), run.channel[c].end(),
                                    [](const Estimate& e) { return e.unknown_mm > 0.0; });
    if (rows == 0) continue;
    const auto& features = model.channels[c].features;
    const std::string needs = features.feed_taus_s.empty() ? "spindle_rpm" : "spindle_rpm and feed_mm_min";
    diagnostics.warning(file, {},
                        "run '" + run.run + "': the model of '" + model.channels[c].channel + "' needs " +
                            needs + ", not read in time for " + std::to_string(rows) + " of " +
                            std::to_string(run.time_s.size()) +
                            " rows: sigma is wider there, or the last measurement is held");
  }
}

// One line for each run and channel that goes where no training run was.
void tell_outside_training(const ThermalModel& model, const RunPrediction& run, const std::string& file,
                           Diagnostics& diagnostics) {
  for (std::size_t c = 0; c < model.channels.size(); ++c) {
    const auto& all = run.channel[c];
    const auto rows =
        std::count_if(all.begin(), all.end(), [](const Estimate& e) { return e.outside_training(); });
    if (rows == 0) continue;
    const auto farthest = std::max_element(
        all.begin(), all.end(), [](const Estimate& a, const Estimate& b) { return a.distance < b.distance; });
    diagnostics.warning(
        file, {},
        "run '" + run.run + "': " + std::to_string(rows) + " of " + std::to_string(run.time_s.size()) +
            " rows lie outside of what the model of '" + model.channels[c].channel +
            "' was fitted to, farthest " + fixed_text(farthest->distance, 1) + " times at " +
            fixed_text(run.time_s[static_cast<std::size_t>(farthest - all.begin())], 0) +
            " s: a warmer machine, a faster spindle, or a sensor or clock in another unit? What is predicted "
            "there is not known to hold");
  }
}

}  // namespace

void warn_of_prediction(const ThermalModel& model, const Log& log, const LogRun& run,
                        const RunPrediction& prediction, Diagnostics& diagnostics) {
  tell_unknown_inputs(model, prediction, log.file, diagnostics);
  tell_outside_training(model, prediction, log.file, diagnostics);
  for (const std::string& warning : prediction.warnings)
    diagnostics.warning(log.file, {}, "run '" + run.id + "': " + warning);
  if (const auto swapped = find_swapped(model, log, run)) {
    diagnostics.warning(log.file, {},
                        "run '" + run.id + "': are sensors '" + swapped->one + "' and '" + swapped->other +
                            "' exchanged? As it is the run moves " + fixed_text(swapped->distance, 1) +
                            " times as far as any of the training, with the two exchanged " +
                            fixed_text(swapped->exchanged, 1) + " times");
  }
}

}  // namespace trunnion::app
