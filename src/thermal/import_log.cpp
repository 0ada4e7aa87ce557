#include "trunnion/thermal/import_log.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fnmatch.h>
#include <map>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"

#include "thermal/foreign_text.hpp"

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

// The name without its unit and without what our own format puts before and behind it.
std::string bare_name(const std::string& name) {
  for (const std::string_view suffix : {"_degC", "_C", "_um", "_mm"}) {
    if (!name.ends_with(suffix) || name.size() == suffix.size()) continue;
    const std::string out = name.substr(0, name.size() - suffix.size());
    return suffix == "_degC" && out.starts_with("T_") && out.size() > 2 ? out.substr(2) : out;
  }
  return name;
}

bool matches(const std::vector<std::string>& patterns, const std::string& name) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::string& p) { return fnmatch(p.c_str(), name.c_str(), 0) == 0; });
}

std::string in_small_letters(const std::string& text) {
  std::string out;
  for (const char c : text) out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// Of a column `time_ms`, `Time [ms]`, `t (min)`: what stands before the unit, and the unit in seconds.
struct TimeName {
  std::string stem;
  std::optional<double> seconds;
};

TimeName time_name(const std::string& column) {
  static const std::map<std::string, double> units = {{"s", 1.0},
                                                      {"sec", 1.0},
                                                      {"second", 1.0},
                                                      {"seconds", 1.0},
                                                      {"ms", 1e-3},
                                                      {"msec", 1e-3},
                                                      {"milliseconds", 1e-3},
                                                      {"us", 1e-6},
                                                      {"\u00b5s", 1e-6},
                                                      {"\u03bcs", 1e-6},
                                                      {"min", kSecondsPerMinute},
                                                      {"minutes", kSecondsPerMinute},
                                                      {"h", 3600.0},
                                                      {"hours", 3600.0}};
  const std::string name = in_small_letters(column);
  const auto last = name.find_last_not_of(" ])");
  const auto before = name.find_last_of(" _[(/", last);
  if (before == std::string::npos || last == std::string::npos || before == 0) return {name, {}};
  const auto unit = units.find(name.substr(before + 1, last - before));
  if (unit == units.end()) return {name, {}};
  return {name.substr(0, name.find_last_not_of(" _[(/", before) + 1), unit->second};
}

std::optional<std::size_t> time_column(const config::CsvRows& rows, const ImportOptions& options) {
  if (!options.time_column.empty()) return rows.column(options.time_column);
  if (const auto ours = rows.column("time_s")) return ours;
  for (const std::string_view known : {"time", "timestamp", "datetime", "date", "zeit"}) {
    for (std::size_t i = 0; i < rows.columns().size(); ++i)
      if (time_name(rows.columns()[i]).stem == known) return i;
  }
  return std::nullopt;
}

// What every pattern and name of the options must find.
void tell_missing(const config::CsvRows& rows, const ImportOptions& options, const Sources& sources,
                  Diagnostics& diagnostics) {
  const SourceRef header{rows.header_line(), 1};
  const auto missing = [&](const std::string& name) {
    diagnostics.error(rows.file(), header, "no column '" + name + "'");
  };
  if (!sources.time && !options.time_column.empty()) {
    missing(options.time_column);
  } else if (!sources.time && !options.step_s) {
    diagnostics.error(rows.file(), header,
                      "no column 'time_s': name the one of the time (--time NAME), or how far the rows are "
                      "apart (--step-s S)");
  }
  if (!options.run_column.empty() && !sources.run) missing(options.run_column);
  if (options.run_starts_with_spindle && !sources.speed) missing(options.speed_column);
  for (const auto* patterns : {&options.sensors, &options.channels}) {
    for (const auto& pattern : *patterns) {
      if (std::none_of(rows.columns().begin(), rows.columns().end(),
                       [&](const std::string& name) { return matches({pattern}, name); }))
        missing(pattern);
    }
  }
  if (diagnostics.has_errors() || options.part) return;
  if (sources.sensors.empty())
    diagnostics.error(
        rows.file(), header,
        "no column is a temperature: name them (--sensor PATTERN), or --part for a file of channels only");
  if (sources.channels.empty())
    diagnostics.error(rows.file(), header,
                      "no column is a measured channel: name them (--channel PATTERN), or --part for a file "
                      "of sensors only");
}

Sources find_sources(const config::CsvRows& rows, const ImportOptions& options, Log& log,
                     Diagnostics& diagnostics) {
  Sources out;
  if (!options.step_s) out.time = time_column(rows, options);
  out.speed = rows.column(options.speed_column);
  if (!options.run_column.empty()) out.run = rows.column(options.run_column);
  for (std::size_t i = 0; i < rows.columns().size(); ++i) {
    const std::string& name = rows.columns()[i];
    if (i == out.time || i == out.run || i == out.speed) continue;
    if (matches(options.channels, name)) {
      log.channels.push_back(bare_name(name));
      out.channels.push_back({i, name.ends_with("_um")   ? kMmPerUm
                                 : name.ends_with("_mm") ? 1.0
                                                         : options.um_per_count * kMmPerUm});
    } else if (matches(options.sensors, name) || name.ends_with("_C") || name.ends_with("_degC")) {
      log.sensors.push_back(bare_name(name));
      out.sensors.push_back({i, 1.0});
    } else if (name.ends_with("_um")) {
      log.channels.push_back(bare_name(name));
      out.channels.push_back({i, kMmPerUm});
    } else {
      diagnostics.note(rows.file(), {rows.header_line(), static_cast<std::uint32_t>(i + 1)},
                       "column '" + name +
                           "' is ignored: its name does not end in _C, _degC or _um, and --sensor, "
                           "--channel, --run or --speed do not name it");
    }
  }
  tell_missing(rows, options, out, diagnostics);
  log.has_speed = out.speed.has_value();
  return out;
}

// Seconds of a count of the column of the time; nothing where nobody says it.
std::optional<double> count_s(const config::CsvRows& rows, const Sources& sources,
                              const ImportOptions& options, const ForeignText& foreign) {
  if (!sources.time || foreign.dated.contains(*sources.time)) return 1.0;
  if (options.seconds_per_count) return options.seconds_per_count;
  return time_name(rows.columns()[*sources.time]).seconds;
}

double time_of(config::CsvRows& rows, const Sources& sources, const ImportOptions& options, double count_s,
               std::size_t count) {
  if (options.step_s) return *options.step_s * static_cast<double>(count);
  return rows.number(*sources.time).value_or(0.0) * count_s;
}

// Numbers without a unit may be anything.
void tell_unit(const config::CsvRows& rows, std::size_t column, const LogRun& run, Diagnostics& diagnostics) {
  if (run.rows() < 2) return;
  diagnostics.warning(rows.file(), {rows.header_line(), static_cast<std::uint32_t>(column + 1)},
                      "column '" + rows.columns()[column] +
                          "' names no unit: its numbers are taken for seconds, rows " +
                          shortest_text(run.time_s[1] - run.time_s[0]) +
                          " s apart. If they are not, give --seconds-per-count");
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
  // Before its bytes are taken for fields.
  if (const auto error = config::workbook_error(text)) {
    diagnostics.error(file, {1, 1}, *error);
    return tl::unexpected(diagnostics.first_error());
  }
  const ForeignText foreign = plain_csv(text, options.delimiter, options.skip_lines);
  if (foreign.not_read > 0)
    diagnostics.note(file, {}, std::to_string(foreign.not_read) + " fields like N/A count as not read");
  config::CsvRows rows(foreign.csv, file, diagnostics);
  Log log;
  log.file = file;
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  const Sources sources = find_sources(rows, options, log, diagnostics);
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  double start_s = 0.0;
  std::size_t count = 0;
  double speed_before = 0.0;
  const auto seconds = count_s(rows, sources, options, foreign);
  while (rows.next()) {
    const double time_s = time_of(rows, sources, options, seconds.value_or(1.0), count++);
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
      diagnostics.error(file, {rows.line(), static_cast<std::uint32_t>(sources.time.value_or(0) + 1)},
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
  if (!seconds) tell_unit(rows, *sources.time, log.runs.front(), diagnostics);
  return log;
}

}  // namespace trunnion::thermal
