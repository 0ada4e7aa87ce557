#include "trunnion/thermal/import_log.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"

namespace trunnion::thermal {
namespace {

struct Source {
  std::size_t column = 0;
  double factor = 1.0;
};

struct Sources {
  std::optional<std::size_t> time, run, speed;
  std::vector<Source> sensors, channels;
};

std::string without_suffix(const std::string& name, std::string_view suffix) {
  return name.substr(0, name.size() - suffix.size());
}

Sources find_sources(const config::CsvRows& rows, const ImportOptions& options, Log& log,
                     Diagnostics& diagnostics) {
  Sources out;
  out.time = rows.column(options.time_column);
  out.speed = rows.column(options.speed_column);
  if (!options.run_column.empty()) out.run = rows.column(options.run_column);
  const SourceRef header{rows.header_line(), 1};
  if (!out.time) diagnostics.error(rows.file(), header, "no column '" + options.time_column + "'");
  if (!options.run_column.empty() && !out.run)
    diagnostics.error(rows.file(), header, "no column '" + options.run_column + "'");
  if (options.run_starts_with_spindle && !out.speed)
    diagnostics.error(rows.file(), header, "no column '" + options.speed_column + "'");
  for (std::size_t i = 0; i < rows.columns().size(); ++i) {
    const std::string& name = rows.columns()[i];
    const bool named =
        std::find(options.channels.begin(), options.channels.end(), name) != options.channels.end();
    if (named) {
      log.channels.push_back(name);
      out.channels.push_back({i, options.um_per_count * kMmPerUm});
    } else if (name.ends_with("_um")) {
      log.channels.push_back(without_suffix(name, "_um"));
      out.channels.push_back({i, kMmPerUm});
    } else if (name.ends_with("_C") || name.ends_with("_degC")) {
      log.sensors.push_back(without_suffix(name, name.ends_with("_degC") ? "_degC" : "_C"));
      out.sensors.push_back({i, 1.0});
    }
  }
  for (const auto& name : options.channels) {
    if (!rows.column(name)) diagnostics.error(rows.file(), header, "no column '" + name + "'");
  }
  log.has_speed = out.speed.has_value();
  return out;
}

LogRun& start_run(Log& log, std::string id) {
  LogRun run;
  run.id = std::move(id);
  run.temperature_degC.resize(log.sensors.size());
  run.sensor_file.assign(log.sensors.size(), log.file);
  run.channel_mm.resize(log.channels.size());
  log.runs.push_back(std::move(run));
  return log.runs.back();
}

}  // namespace

Result<Log> import_log(std::string_view text, const std::string& file, const ImportOptions& options,
                       Diagnostics& diagnostics) {
  const std::size_t errors_before = diagnostics.error_count();
  config::CsvRows rows(text, file, diagnostics);
  Log log;
  log.file = file;
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  const Sources sources = find_sources(rows, options, log, diagnostics);
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  double start_s = 0.0;
  double speed_before = 0.0;
  while (rows.next()) {
    const double time_s = rows.number(*sources.time).value_or(0.0) * options.seconds_per_count;
    const double speed = sources.speed ? rows.number_or_nan(*sources.speed).value_or(0.0) : 0.0;
    const std::string id = sources.run ? std::string(rows.fields()[*sources.run]) : "1";
    bool starts = log.runs.empty() || (sources.run && log.runs.back().id != id);
    if (options.run_starts_with_spindle) starts = speed > 0.0 && !(speed_before > 0.0);
    speed_before = speed;
    if (starts) {
      start_run(log, options.run_starts_with_spindle ? std::to_string(log.runs.size() + 1) : id);
      start_s = time_s;
    }
    if (log.runs.empty()) continue;  // before the first start of the spindle
    LogRun& run = log.runs.back();
    if (!run.time_s.empty() && time_s - start_s <= run.time_s.back()) {
      diagnostics.error(file, {rows.line(), static_cast<std::uint32_t>(*sources.time + 1)},
                        "time " + shortest_text(time_s) + " s does not come after the row before");
    }
    run.time_s.push_back(time_s - start_s);
    if (sources.speed) run.spindle_rpm.push_back(speed);
    for (std::size_t i = 0; i < sources.sensors.size(); ++i)
      run.temperature_degC[i].push_back(rows.number_or_nan(sources.sensors[i].column).value_or(0.0));
    for (std::size_t i = 0; i < sources.channels.size(); ++i)
      run.channel_mm[i].push_back(rows.number_or_nan(sources.channels[i].column).value_or(0.0) *
                                  sources.channels[i].factor);
  }
  if (log.runs.empty()) diagnostics.error(file, {rows.header_line(), 1}, "no rows that belong to a run");
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  return log;
}

}  // namespace trunnion::thermal
