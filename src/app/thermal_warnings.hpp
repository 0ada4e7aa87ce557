#pragma once
#include "trunnion/thermal/predictor.hpp"

namespace trunnion::app {

/// What is doubtful in the offsets that `model` gives for `run` of `log`, as warnings: inputs that it needs
/// and did not get, sensors that look exchanged.
void warn_of_prediction(const thermal::ThermalModel& model, const thermal::Log& log,
                        const thermal::LogRun& run, const thermal::RunPrediction& prediction,
                        Diagnostics& diagnostics);

}  // namespace trunnion::app
