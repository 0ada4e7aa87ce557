#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "trunnion/base/units.hpp"
#include "trunnion/report/thermal_report.hpp"

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;
using namespace thermal;

double in_um(double mm) {
  return mm / kMmPerUm;
}

ordered_json score_json(const Score& score) {
  ordered_json out;
  out["name"] = score.name;
  out["rmse_um"] = in_um(score.rmse_mm);
  out["p95_um"] = in_um(score.p95_mm);
  out["worst_run_rmse_um"] = in_um(score.worst_run_rmse_mm);
  out["mean_run_rmse_um"] = in_um(score.mean_run_rmse_mm);
  out["median_run_rmse_um"] = in_um(score.median_run_rmse_mm);
  out["window_rmse_um"] = in_um(score.window_rmse_mm);
  out["window_worst_rmse_um"] = in_um(score.window_worst_rmse_mm);
  for (const double rmse : score.run_rmse_mm) out["run_rmse_um"].push_back(in_um(rmse));
  return out;
}

ordered_json faults_json(const std::vector<SensorFault>& faults) {
  ordered_json out = ordered_json::array();
  for (const SensorFault& f : faults) {
    out.push_back({{"run_id", f.run},
                   {"sensor", f.sensor},
                   {"fault", fault_name(f.kind)},
                   {"from_s", f.from_s},
                   {"to_s", f.to_s},
                   {"readings", f.readings}});
  }
  return out;
}

}  // namespace

std::string thermal_fit_json(const FitResult& result, const thermal::FitOptions& options,
                             const std::vector<SensorFault>& faults) {
  ordered_json out;
  out["measure_every_min"] = options.measure_every_s / kSecondsPerMinute;
  out["window_min"] = options.window_s / kSecondsPerMinute;
  out["validation"] = "leave-one-run-out";
  out["runs"] = result.model.runs;
  out["data_hash"] = result.model.data_hash;
  out["channels"] = ordered_json::object();
  for (std::size_t c = 0; c < result.channels.size(); ++c) {
    const ChannelReport& channel = result.channels[c];
    const ChannelModel& model = result.model.channels[c];
    ordered_json j;
    j["chosen"] = channel.chosen;
    j["models"] = ordered_json::array();
    for (const Score& score : channel.models) j["models"].push_back(score_json(score));
    j["nested"] = channel.nested ? score_json(*channel.nested) : ordered_json(nullptr);
    j["sigma_floor_um"] = in_um(model.sigma.floor_mm);
    j["sigma_growth_um_per_sqrt_min"] =
        in_um(model.sigma.growth_mm_per_sqrt_s) * std::sqrt(kSecondsPerMinute);
    j["sigma_per_change"] = model.sigma.per_change;
    j["sigma_per_move_um"] = in_um(model.sigma.per_move_mm);
    j["sigma_per_krpm_um"] = in_um(model.sigma.per_krpm_mm);
    j["sigma_per_swing_um"] = in_um(model.sigma.per_swing_mm);
    j["sigma_prior_measurements"] = model.sigma.prior_measurements;
    j["sigma_coverage_factor"] = model.sigma.coverage.quiet;
    j["sigma_coverage_factor_lively"] = model.sigma.coverage.lively;
    j["coverage_95"] = ordered_json::object();
    for (std::size_t r = 0; r < channel.coverage.size(); ++r)
      j["coverage_95"][channel.runs[r]] =
          std::isfinite(channel.coverage[r]) ? ordered_json(channel.coverage[r]) : ordered_json(nullptr);
    j["inputs"] = ordered_json::array();
    for (const InputEffect& input : channel.inputs)
      j["inputs"].push_back({{"name", input.name}, {"rms_um", in_um(input.rms_mm)}});
    j["axis"] = model.axis.empty() ? ordered_json(nullptr) : ordered_json(model.axis);
    j["notes"] = channel.notes;
    out["channels"][channel.channel] = std::move(j);
  }
  out["sensor_faults"] = faults_json(faults);
  return json_text(out);
}

std::string thermal_screen_json(const std::vector<ChannelScreen>& channels,
                                const std::vector<SensorFault>& faults) {
  ordered_json out;
  out["channels"] = ordered_json::object();
  for (const ChannelScreen& channel : channels) {
    ordered_json j;
    j["measurements"] = channel.measurements;
    j["runs"] = channel.runs;
    j["condition_number"] =
        std::isfinite(channel.condition) ? ordered_json(channel.condition) : ordered_json(nullptr);
    j["sensors"] = ordered_json::array();
    for (const SensorScreen& s : channel.sensors) {
      ordered_json sensor;
      sensor["name"] = s.sensor;
      sensor["shapiro_wilk_W"] = s.normality ? ordered_json(s.normality->W) : ordered_json(nullptr);
      sensor["shapiro_wilk_p"] = s.normality ? ordered_json(s.normality->p) : ordered_json(nullptr);
      sensor["p_value"] = s.p ? ordered_json(*s.p) : ordered_json(nullptr);
      sensor["vif"] =
          std::isfinite(s.variance_inflation) ? ordered_json(s.variance_inflation) : ordered_json(nullptr);
      sensor["chosen_by_p"] = s.chosen_by_p;
      sensor["chosen_by_held_out_runs"] = s.chosen_by_runs;
      sensor["share_of_folds_chosen_by_p"] = s.share_of_folds;
      j["sensors"].push_back(std::move(sensor));
    }
    j["jaccard_of_p"] = channel.p_jaccard;
    j["heldout_rmse_um"] = {{"all", in_um(channel.heldout_all_mm)},
                            {"chosen_by_p", in_um(channel.heldout_p_mm)},
                            {"chosen_by_held_out_runs", in_um(channel.heldout_runs_mm)}};
    j["warnings"] = channel.warnings;
    out["channels"][channel.channel] = std::move(j);
  }
  out["sensor_faults"] = faults_json(faults);
  return json_text(out);
}

std::string thermal_predict_json(const ThermalModel& model, const std::vector<RunPrediction>& runs) {
  ordered_json out;
  out["runs"] = ordered_json::array();
  for (const RunPrediction& run : runs) {
    ordered_json j;
    j["run_id"] = run.run;
    j["rows"] = run.time_s.size();
    for (std::size_t c = 0; c < model.channels.size(); ++c) {
      std::size_t outside = 0;
      std::size_t stale = 0;
      std::size_t unknown = 0;
      double largest = 0.0;
      for (const Estimate& e : run.channel[c]) {
        if (e.outside_training()) ++outside;
        if (e.stale) ++stale;
        if (e.unknown_mm > 0.0) ++unknown;
        largest = std::max(largest, std::abs(e.value_mm));
      }
      ordered_json channel;
      channel["axis"] = model.channels[c].axis;
      channel["method"] = model.channels[c].candidate.name();
      channel["last_um"] = run.channel[c].empty() ? 0.0 : in_um(run.channel[c].back().value_mm);
      channel["last_sigma_um"] = run.channel[c].empty() ? 0.0 : in_um(run.channel[c].back().sigma_mm);
      channel["largest_um"] = in_um(largest);
      channel["rows_outside_training"] = outside;
      channel["rows_with_stale_sensor"] = stale;
      channel["rows_with_unknown_speed_or_feed"] = unknown;
      j["channels"][model.channels[c].channel] = std::move(channel);
    }
    out["runs"].push_back(std::move(j));
  }
  return json_text(out);
}

std::string thermal_split_json(const DriftSplit& split, const std::vector<std::string>& refused) {
  ordered_json out;
  out["rank"] = split.rank;
  out["parameters_count"] = split.parameters.size();
  out["condition"] = split.condition;
  out["rms_um"] = in_um(split.rms_mm);
  for (const DriftParameter& p : split.parameters) {
    ordered_json j;
    j["identifiable"] = p.identifiable;
    if (p.identifiable) {
      j["value_um"] = in_um(p.value_mm);
      j["sigma_um"] = in_um(p.sigma_mm);
    }
    out["parameters"][p.name] = std::move(j);
  }
  out["null_directions"] = split.null_directions;
  out["refused"] = refused;
  return json_text(out);
}

std::string thermal_log_json(const Log& log) {
  ordered_json runs = ordered_json::array();
  for (const LogRun& run : log.runs) {
    const double duration = run.time_s.empty() ? 0.0 : run.time_s.back() - run.time_s.front();
    ordered_json channels = ordered_json::object();
    double largest_rise_K = 0.0;
    const auto range = [](const std::vector<double>& values) {
      std::pair<double, double> out{std::numeric_limits<double>::infinity(),
                                    -std::numeric_limits<double>::infinity()};
      for (const double v : values) {
        if (!std::isfinite(v)) continue;
        out = {std::min(out.first, v), std::max(out.second, v)};
      }
      return out;
    };
    for (std::size_t c = 0; c < log.channels.size(); ++c) {
      const auto [low, high] = range(run.channel_mm[c]);
      if (low <= high) channels[log.channels[c]] = {{"smallest_um", in_um(low)}, {"largest_um", in_um(high)}};
    }
    for (const auto& sensor : run.temperature_degC) {
      const auto [low, high] = range(sensor);
      if (low <= high) largest_rise_K = std::max(largest_rise_K, high - low);
    }
    runs.push_back({{"run_id", run.id},
                    {"rows", run.rows()},
                    {"duration_s", duration},
                    {"hours", duration / (60.0 * kSecondsPerMinute)},
                    {"channels", std::move(channels)},
                    {"largest_rise_K", largest_rise_K}});
  }
  const ordered_json out = {{"runs", runs}, {"sensors", log.sensors}, {"channels", log.channels}};
  return json_text(out);
}

std::string thermal_assess_json(const std::vector<BladeResult>& blades, double tolerance_mm) {
  ordered_json rows = ordered_json::array();
  for (const BladeResult& b : blades)
    rows.push_back({{"run_id", b.run},
                    {"blade", b.blade},
                    {"before_um", in_um(b.before_mm)},
                    {"after_um", in_um(b.after_mm)}});
  const ordered_json out = {
      {"tolerance_mm", tolerance_mm},
      {"share_within_before", share_within(blades, &BladeResult::before_mm, tolerance_mm)},
      {"share_within_after", share_within(blades, &BladeResult::after_mm, tolerance_mm)},
      {"rms_before_um", in_um(rms_mm(blades, &BladeResult::before_rms_mm))},
      {"rms_after_um", in_um(rms_mm(blades, &BladeResult::after_rms_mm))},
      {"measurement_floor_um", in_um(kMeasurementFloor_mm)},
      {"blades", rows}};
  return json_text(out);
}

}  // namespace trunnion::report
