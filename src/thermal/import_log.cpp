#include "trunnion/thermal/import_log.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fnmatch.h>
#include <map>

#include "trunnion/base/median.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"

#include "thermal/foreign_text.hpp"

namespace trunnion::thermal {
namespace {

// The number in our unit: factor * (number + offset).
struct Source {
  std::size_t column = 0;
  double factor = 1.0, offset = 0.0;
  double taken(double number) const { return factor * (number + offset); }
};

struct Sources {
  std::optional<std::size_t> time, run, speed;
  std::vector<Source> sensors, channels;
};

bool matches(const std::vector<std::string>& patterns, const std::string& name) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::string& p) { return fnmatch(p.c_str(), name.c_str(), 0) == 0; });
}

std::string in_small_letters(const std::string& text) {
  std::string out;
  for (const char c : text) out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// Of a column `time_ms`, `Time [ms]`, `t (min)`: what stands before the unit, and the unit as it is written.
struct NameWithUnit {
  std::string stem, unit;
  bool bracketed = false;  // [m], (in): as a last word they may mean anything
};

NameWithUnit name_with_unit(const std::string& column) {
  constexpr std::string_view kBegins = " _[(/";
  const auto last = column.find_last_not_of(" ])");
  const auto before = column.find_last_of(kBegins, last);
  if (before == std::string::npos || last == std::string::npos || before == 0) return {column, {}};
  const auto stem = column.find_last_not_of(kBegins, before);
  return stem == std::string::npos
             ? NameWithUnit{column, {}}
             : NameWithUnit{column.substr(0, stem + 1), column.substr(before + 1, last - before),
                            column[before] == '[' || column[before] == '('};
}

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
  const NameWithUnit parts = name_with_unit(name);
  const auto unit = units.find(parts.unit);
  if (unit == units.end()) return {name, {}};
  return {parts.stem, unit->second};
}

// Of a channel, in mm; nothing where the name has no unit of length.
std::optional<double> length_unit(const NameWithUnit& name) {
  constexpr double kMmPerMil = kMmPerInch / 1000.0;
  static const std::map<std::string, double> units = {
      {"um", kMmPerUm},      {"\u00b5m", kMmPerUm}, {"\u03bcm", kMmPerUm},  {"micron", kMmPerUm},
      {"microns", kMmPerUm}, {"mm", 1.0},           {"nm", 1e-6},           {"m", 1000.0},
      {"in", kMmPerInch},    {"inch", kMmPerInch},  {"inches", kMmPerInch}, {"mil", kMmPerMil},
      {"mils", kMmPerMil},   {"thou", kMmPerMil}};
  const auto found = units.find(in_small_letters(name.unit));
  const bool may_be_a_word = name.unit.size() == 1 || found == units.find("in");
  return found == units.end() || (may_be_a_word && !name.bracketed) ? std::nullopt
                                                                    : std::optional(found->second);
}

// Of a sensor: degC = factor * (number + offset), and between what a shop's temperatures are in it.
struct TemperatureUnit {
  double factor = 1.0, offset = 0.0;
  double least = -50.0, most = 300.0;
  const char* name = "degrees Celsius";
};
std::optional<TemperatureUnit> temperature_unit(const std::string& unit) {
  constexpr TemperatureUnit kCelsius = {},
                            kFahrenheit = {1.0 / 1.8, -32.0, 35.0, 570.0, "degrees Fahrenheit"},
                            kKelvin = {1.0, -273.15, 220.0, 570.0, "kelvin"};
  for (const char* known : {"C", "degC", "\u00b0C", "\u2103", "c", "degc", "celsius", "Celsius"})
    if (unit == known) return kCelsius;
  for (const char* known : {"F", "degF", "\u00b0F", "\u2109", "degf", "fahrenheit", "Fahrenheit"})
    if (unit == known) return kFahrenheit;
  for (const char* known : {"K", "kelvin", "Kelvin"})
    if (unit == known) return kKelvin;
  return std::nullopt;
}

// The name without its unit and without what our own format puts before it.
std::string bare_name(const std::string& column) {
  const NameWithUnit parts = name_with_unit(column);
  const bool temperature = temperature_unit(parts.unit).has_value();
  if (!temperature && !length_unit(parts)) return column;
  const bool ours = temperature && parts.stem.starts_with("T_") && parts.stem.size() > 2;
  return ours ? parts.stem.substr(2) : parts.stem;
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
    const NameWithUnit parts = name_with_unit(name);
    const auto degrees = temperature_unit(parts.unit);
    const auto length = length_unit(parts);
    if (matches(options.channels, name)) {
      log.channels.push_back(bare_name(name));
      out.channels.push_back({i, length.value_or(options.um_per_count * kMmPerUm)});
    } else if (matches(options.sensors, name) || (degrees && parts.unit != "K" && parts.unit != "F")) {
      const TemperatureUnit of = degrees.value_or(TemperatureUnit{});
      log.sensors.push_back(bare_name(name));
      out.sensors.push_back({i, of.factor, of.offset});
    } else if (length == kMmPerUm) {
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

// A name that ends in another unit than degrees Celsius, against the numbers: `front_F` may be the front.
void tell_temperatures(const config::CsvRows& rows, const Sources& sources, const Log& log,
                       Diagnostics& diagnostics) {
  for (std::size_t i = 0; i < sources.sensors.size(); ++i) {
    const Source& source = sources.sensors[i];
    const std::string& name = rows.columns()[source.column];
    const auto unit = temperature_unit(name_with_unit(name).unit);
    if (!unit || source.offset == 0.0) continue;
    std::vector<double> degC;
    for (const LogRun& run : log.runs)
      for (const double value : run.temperature_degC[i])
        if (!std::isnan(value)) degC.push_back(value);
    if (degC.empty()) continue;
    const double typical_degC = median(std::move(degC));
    const double number = typical_degC / unit->factor - unit->offset;
    const SourceRef where{rows.header_line(), static_cast<std::uint32_t>(source.column + 1)};
    const std::string says = "column '" + name + "' ends like " + unit->name;
    if (number < unit->least || number > unit->most)
      diagnostics.error(rows.file(), where,
                        says + ", and its numbers, about " + fixed_text(number, 1) +
                            ", are none of a machine: name it ..._degC if they are degrees Celsius");
    else
      diagnostics.note(rows.file(), where,
                       says + ": about " + fixed_text(number, 1) + " is taken for " +
                           fixed_text(typical_degC, 1) + " degC");
  }
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
      run.temperature_degC[i].push_back(
          sources.sensors[i].taken(rows.number_or_nan(sources.sensors[i].column).value_or(0.0)));
    for (std::size_t i = 0; i < sources.channels.size(); ++i)
      run.channel_mm[i].push_back(
          sources.channels[i].taken(rows.number_or_nan(sources.channels[i].column).value_or(0.0)));
  }
  if (log.runs.empty()) diagnostics.error(file, {rows.header_line(), 1}, "no rows that belong to a run");
  tell_temperatures(rows, sources, log, diagnostics);
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  if (!seconds) tell_unit(rows, *sources.time, log.runs.front(), diagnostics);
  return log;
}

}  // namespace trunnion::thermal
