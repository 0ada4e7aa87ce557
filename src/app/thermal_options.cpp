#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <fmt/ranges.h>
#include <string>
#include <utility>
#include <vector>

#include "trunnion/base/units.hpp"
#include "trunnion/effects/model_values.hpp"
#include "trunnion/thermal/condition.hpp"
#include "trunnion/thermal/predictor.hpp"

#include "app/options.hpp"
#include "app/thermal_warnings.hpp"

// What comes from temperatures: the sensors of a model, offsets, and what a control is to calculate.

namespace trunnion::app {

namespace {

// Temperatures of the one run of a log by these sensors, above reference; a value holds until the
// next one.
post::TemperatureHistory history_of(const thermal::Log& log, const std::vector<std::string>& names,
                                    double reference_degC) {
  const thermal::LogRun& run = log.runs.front();
  post::TemperatureHistory out;
  out.time_s = run.time_s;
  std::vector<double> now(names.size(), 0.0);
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto& column = run.temperature_degC[*log.sensor(names[k])];
    const auto first = std::find_if(column.begin(), column.end(), [](double t) { return std::isfinite(t); });
    if (first != column.end()) now[k] = *first - reference_degC;
  }
  out.temperature_K.reserve(run.rows());
  for (std::size_t row = 0; row < run.rows(); ++row) {
    for (std::size_t k = 0; k < names.size(); ++k) {
      const double t = run.temperature_degC[*log.sensor(names[k])][row];
      if (std::isfinite(t)) now[k] = t - reference_degC;
    }
    out.temperature_K.push_back(now);
  }
  return out;
}

// A model whose channels give at least one offset.
Result<thermal::ThermalModel> offset_model(const std::string& path, Diagnostics& diagnostics) {
  auto model = thermal::load_model(path, diagnostics);
  if (!model) return model;
  if (const auto said = thermal::check_axes(*model, path); !said) return tl::unexpected(said.error());
  const auto gives = [](const thermal::ChannelModel& c) { return thermal::offset_component(c).has_value(); };
  if (std::none_of(model->channels.begin(), model->channels.end(), gives))
    return fail(ErrorCode::wrong_input, "no channel of this model gives an offset (thermal fit --axes)",
                path);
  return model;
}

Result<thermal::Log> one_run_log(const std::string& path, Diagnostics& diagnostics,
                                 std::vector<thermal::SensorFault>& faults) {
  auto log = thermal::load_conditioned_logs({path}, diagnostics, faults);
  if (!log) return log;
  if (log->runs.size() != 1) {
    return fail(ErrorCode::wrong_input,
                "the temperature log must hold one run, not " + std::to_string(log->runs.size()), path);
  }
  return log;
}

// A sensor that was never read would count as at reference: what it asks for would be left out, in a program
// that is called verified.
Result<void> must_hold(const thermal::Log& log, const std::vector<std::string>& sensors,
                       const std::string& model) {
  for (const std::string& name : sensors) {
    const auto sensor = log.sensor(name);
    const std::string column = "column T_" + name + "_degC";
    if (!sensor)
      return fail(ErrorCode::wrong_input, "the log has no " + column + ", which " + model + " needs",
                  log.file);
    const auto& values = log.runs.front().temperature_degC[*sensor];
    if (std::all_of(values.begin(), values.end(), [](double value) { return std::isnan(value); }))
      return fail(ErrorCode::wrong_input,
                  "the log has no reading in " + column + ", which " + model + " needs: all " +
                      std::to_string(values.size()) + " are empty or cannot be right",
                  log.file);
  }
  return {};
}

// It goes on from the start of each run, and a program is no run of the measurement.
void warn_of_time_drift(const Model& model, Diagnostics& diagnostics) {
  const bool drifts = std::any_of(model.effects.begin(), model.effects.end(), [](const ModelEffect& e) {
    return e.effect->info().id == "time_drift" &&
           std::any_of(e.parameters.begin(), e.parameters.end(),
                       [](const ParameterValue& p) { return p.value != 0.0; });
  });
  if (drifts)
    diagnostics.warning(model.file, {},
                        "time_drift is compensated from the start of the program for as long as it runs. It "
                        "was seen in runs of a measurement; a machine that is warm does not drift so. "
                        "--no-thermal leaves it out");
}

}  // namespace

Result<std::optional<post::RunTimeDrift>> PostCliOptions::load_run_time_drift(
    Diagnostics& diagnostics) const {
  if (no_thermal || thermal_output.form != "variables" || thermal_model.empty())
    return std::optional<post::RunTimeDrift>{};
  const auto loaded = offset_model(thermal_model, diagnostics);
  if (!loaded) return tl::unexpected(loaded.error());
  post::RunTimeDrift out;
  out.sensors = thermal::Predictor(*loaded).sensors();
  const auto weights = thermal::instant_weights(*loaded, out.sensors);
  if (!weights) return tl::unexpected(weights.error());
  out.mm_per_K = *weights;
  const std::size_t sensors = out.sensors.size();
  if (temperatures.empty()) {
    // What will come is not known: rises that move the tool by a quarter of the clamp, other ones of each
    // sensor.
    Eigen::VectorXd rise(static_cast<Eigen::Index>(sensors));
    for (Eigen::Index i = 0; i < rise.size(); ++i) rise[i] = 1.0 + 0.5 * static_cast<double>(i % 3);
    const double largest_mm = (out.mm_per_K * rise).cwiseAbs().maxCoeff();
    if (largest_mm > 0.0) rise *= 0.25 * thermal_output.limits.clamp_um * kMmPerUm / largest_mm;
    out.history.time_s = {-1.0, 0.0};  // the part's zero was taken before
    out.history.temperature_K = {std::vector<double>(sensors, 0.0), {rise.begin(), rise.end()}};
    return std::optional<post::RunTimeDrift>(std::move(out));
  }
  std::vector<thermal::SensorFault> faults;
  auto log = one_run_log(temperatures, diagnostics, faults);
  if (!log) return tl::unexpected(log.error());
  if (auto held = must_hold(*log, out.sensors, thermal_model); !held) return tl::unexpected(held.error());
  out.history = history_of(*log, out.sensors, 0.0);
  const std::vector<double> first = out.history.temperature_K.front();
  for (auto& row : out.history.temperature_K) {
    for (std::size_t k = 0; k < sensors; ++k) row[k] -= first[k];
  }
  return std::optional<post::RunTimeDrift>(std::move(out));
}

Result<std::optional<thermal::OffsetTable>> PostCliOptions::load_offsets(
    Diagnostics& diagnostics, const std::optional<post::RunTimeDrift>& drift) const {
  if (!temperatures.empty() && thermal_model.empty() && model.empty())
    return fail(ErrorCode::wrong_use, "--temperatures belongs to --thermal or --model");
  if (!no_thermal && thermal_output.form == "variables" && offsets.empty()) {
    // What the variables will hold is not known: the terms are verified with a drift of some size in each.
    thermal::OffsetTable table;
    table.file = "(variables)";
    table.rows.push_back({0.0, {}, Vec3(0.031, -0.023, 0.017), 0.0});
    if (drift) {
      table.rows.clear();
      for (std::size_t row = 0; row < drift->history.time_s.size(); ++row) {
        const auto& K = drift->history.temperature_K[row];
        const Eigen::Map<const Eigen::VectorXd> rise(K.data(), static_cast<Eigen::Index>(K.size()));
        table.rows.push_back({drift->history.time_s[row], {}, Vec3(drift->mm_per_K * rise), 0.0});
      }
    }
    return std::optional<thermal::OffsetTable>(std::move(table));
  }
  if (no_thermal || (offsets.empty() && thermal_model.empty())) return std::optional<thermal::OffsetTable>{};
  if (!offsets.empty()) {
    auto table = thermal::load_offsets(offsets, diagnostics);
    if (!table) return tl::unexpected(table.error());
    return std::optional<thermal::OffsetTable>(std::move(*table));
  }
  if (temperatures.empty()) return fail(ErrorCode::wrong_use, "--thermal needs --temperatures LOG.csv");
  const auto loaded = offset_model(thermal_model, diagnostics);
  if (!loaded) return tl::unexpected(loaded.error());
  std::vector<thermal::SensorFault> faults;
  auto log = one_run_log(temperatures, diagnostics, faults);
  if (!log) return tl::unexpected(log.error());
  if (auto held = must_hold(*log, thermal::Predictor(*loaded).sensors(), thermal_model); !held)
    return tl::unexpected(held.error());
  *log = thermal::without_stuck(*loaded, *log, faults);
  const auto prediction = thermal::predict(*loaded, *log, 0, thermal::UseMeasurements::yes);
  if (!prediction) return tl::unexpected(prediction.error());
  warn_of_prediction(*loaded, *log, log->runs.front(), *prediction, diagnostics);
  return std::optional<thermal::OffsetTable>(thermal::offsets_of(*loaded, *prediction));
}

void warn_of_missing_sensors(const Model& model, const EffectContext& data, Diagnostics& diagnostics) {
  const auto missing = missing_sensors(model, data);
  if (missing.empty()) return;
  diagnostics.warning(model.file, {},
                      fmt::format("the model needs {}, which nothing gives: temperatures count as at "
                                  "reference, states as 0",
                                  fmt::join(missing, ", ")));
}

Result<std::optional<Model>> PostCliOptions::load_errors(
    const Machine& machine, Diagnostics& diagnostics,
    std::optional<post::TemperatureHistory>* history) const {
  if (model.empty()) return std::optional<Model>{};
  std::optional<thermal::Log> log;
  EffectContext context;
  if (history != nullptr && !temperatures.empty() && !no_thermal) {
    std::vector<thermal::SensorFault> faults;
    auto read = one_run_log(temperatures, diagnostics, faults);
    if (!read) return tl::unexpected(read.error());
    log = std::move(*read);
    context.names.temperatures = log->sensors;
  }
  auto loaded = load_model(model, machine, context, diagnostics);
  if (!loaded) return tl::unexpected(loaded.error());
  if (!no_thermal) {
    if (log) {
      // Without the log's context the model knows the sensors alone that it needs.
      Diagnostics told_before;
      const auto alone = load_model(model, machine, {}, told_before);
      if (!alone) return tl::unexpected(alone.error());
      if (auto held = must_hold(*log, alone->context.names.temperatures, model); !held)
        return tl::unexpected(held.error());
    }
    warn_of_missing_sensors(*loaded, context, diagnostics);
  }
  if (log) *history = history_of(*log, loaded->context.names.temperatures, machine.reference_degC);
  Model kept = filtered(*loaded, [&](const EffectInfo& info) {
    return !(info.kind == EffectClass::thermal ? no_thermal : no_geometric);
  });
  if (no_geometric) kept.lag_of_all_axes_s = 0.0;
  warn_of_time_drift(kept, diagnostics);
  if (has_values(kept)) return std::optional<Model>(std::move(kept));
  if (!has_values(*loaded)) diagnostics.warning(model, {}, "no effect has a value: nothing is compensated");
  return std::optional<Model>{};
}

}  // namespace trunnion::app
