#pragma once
#include <string>
#include <vector>

#include "trunnion/report/page.hpp"
#include "trunnion/thermal/condition.hpp"
#include "trunnion/thermal/location.hpp"
#include "trunnion/thermal/predictor.hpp"
#include "trunnion/thermal/screening.hpp"
#include "trunnion/thermal/simulate.hpp"
#include "trunnion/thermal/validation.hpp"

namespace trunnion::report {

/// JSON of `thermal fit`: {"channels": {"dx": {"chosen", "models": [{"name", "rmse_um", "p95_um",
/// "worst_run_rmse_um", ...}]}}}.
std::string thermal_fit_json(const thermal::FitResult& result, const thermal::FitOptions& options,
                             const std::vector<thermal::SensorFault>& faults);
std::string thermal_screen_json(const std::vector<thermal::ChannelScreen>& channels,
                                const std::vector<thermal::SensorFault>& faults);
std::string thermal_predict_json(const thermal::ThermalModel& model,
                                 const std::vector<thermal::RunPrediction>& runs);

/// What `thermal fit` has found: for each channel the error of every method on runs that were held out, by
/// method and by run; the worst run as a model follows it that never saw it, with band, error over time and
/// holding the last measurement beside it; what the chosen model takes from each sensor.
Page thermal_fit_page(const thermal::FitResult& result, const thermal::Log& log,
                      const std::string& result_json, const std::string& made_by);

/// What `thermal predict` says, run by run: each channel over time with twice its sigma, and the measurements
/// of the log.
Page thermal_prediction_page(const thermal::ThermalModel& model, const thermal::Log& log,
                             const std::vector<thermal::RunPrediction>& runs, const std::string& result_json,
                             const std::string& made_by);

/// {"rank", "parameters_count", "condition", "rms_um", "parameters": {"X0C": {"value_um", "sigma_um",
/// "identifiable"}}, "null_directions": [..], "refused": [..]}; no value where it is not identifiable.
std::string thermal_split_json(const thermal::DriftSplit& split, const std::vector<std::string>& refused);

/// {"runs": [{"run_id", "rows", "duration_s", "hours", "channels", "largest_rise_K"}], "sensors", "channels"}
/// of a log that was imported or simulated.
std::string thermal_log_json(const thermal::Log& log);

/// How simulated blades came out, and the share of them within `tolerance_mm`, before and after correction.
std::string thermal_assess_json(const std::vector<thermal::BladeResult>& blades, double tolerance_mm);

/// The same as tables for people.
std::string thermal_split_text(const thermal::DriftSplit& split);
std::string thermal_assess_text(const std::vector<thermal::BladeResult>& blades, double tolerance_mm);
std::string thermal_fit_text(const thermal::FitResult& result, const thermal::FitOptions& options);
std::string thermal_screen_text(const std::vector<thermal::ChannelScreen>& channels);

}  // namespace trunnion::report
