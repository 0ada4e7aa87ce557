#include "trunnion/thermal/log.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/printable.hpp"
#include "trunnion/base/texts.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"
#include "trunnion/config/largest_number.hpp"

namespace trunnion::thermal {
namespace {

// `T_front_degC` with prefix `T_` and suffix `_degC` is `front`; empty when the name has another form.
std::string_view between(std::string_view name, std::string_view prefix, std::string_view suffix) {
  if (name.size() <= prefix.size() + suffix.size() || !name.starts_with(prefix) || !name.ends_with(suffix))
    return {};
  return name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
}

enum class Role { run, time, temperature, speed, feed, channel };
struct LogColumn {
  Role role = Role::channel;
  std::size_t index = 0;                    // of the sensor or channel
  double factor = 1.0;                      // to internal units
  double largest = config::kLargestNumber;  // of its magnitude, as the file has it
};

std::optional<LogColumn> classify(const std::string& name, Log& log) {
  if (name == "run_id") return LogColumn{Role::run};
  if (name == "time_s") return LogColumn{Role::time};
  if (name == "spindle_rpm") {
    log.has_speed = true;
    return LogColumn{Role::speed, 0, 1.0, kFastestSpindle_rpm};
  }
  if (name == "feed_mm_min") {
    log.has_feed = true;
    return LogColumn{Role::feed, 0, 1.0 / kSecondsPerMinute, kFastestFeed_mm_min};
  }
  if (const auto sensor = between(name, "T_", "_degC"); !sensor.empty()) {
    log.sensors.emplace_back(sensor);
    return LogColumn{Role::temperature, log.sensors.size() - 1};
  }
  if (const auto channel = between(name, "", "_um"); !channel.empty()) {
    log.channels.emplace_back(channel);
    return LogColumn{Role::channel, log.channels.size() - 1, kMmPerUm, kLargestDeviation_um};
  }
  return std::nullopt;
}

// Reads the rows of one file; remembers the run of the row before, since a run's rows usually follow each
// other.
class LogReader {
 public:
  LogReader(std::string_view text, const std::string& file, Diagnostics& diagnostics)
      : rows_(text, file, diagnostics), diagnostics_(&diagnostics) {
    log_.file = file;
  }

  void read() {
    read_header();
    if (diagnostics_->has_errors()) return;
    while (rows_.next()) read_row();
    if (log_.runs.empty()) diagnostics_->error(rows_.file(), {rows_.header_line(), 1}, "the log has no rows");
  }
  Log take() { return std::move(log_); }

 private:
  void read_header() {
    for (std::size_t i = 0; i < rows_.columns().size(); ++i) {
      const std::string& name = rows_.columns()[i];
      const auto column = classify(name, log_);
      if (column) {
        if (column->role == Role::time) time_column_ = i;
        if (column->role == Role::run) run_column_ = i;
        columns_.push_back(*column);
      } else {
        diagnostics_->error(
            rows_.file(), {rows_.header_line(), static_cast<std::uint32_t>(i + 1)},
            "column '" + name +
                "' is none of run_id, time_s, T_<name>_degC, spindle_rpm, feed_mm_min, <channel>_um");
      }
    }
    if (!time_column_) diagnostics_->error(rows_.file(), {rows_.header_line(), 1}, "no column 'time_s'");
  }

  void read_row() {
    const auto time_s = rows_.number(*time_column_);
    if (!time_s) return;
    LogRun& run = run_of_row();
    if (!run.time_s.empty() && *time_s <= run.time_s.back()) {
      diagnostics_->error(rows_.file(), {rows_.line(), static_cast<std::uint32_t>(*time_column_ + 1)},
                          "time " + shortest_text(*time_s) + " s of run '" + run.id +
                              "' does not come after " + shortest_text(run.time_s.back()) + " s");
      return;
    }
    run.time_s.push_back(*time_s);
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const LogColumn& column = columns_[i];
      if (column.role == Role::run || column.role == Role::time) continue;
      const double value = value_of(i) * column.factor;
      switch (column.role) {
        case Role::temperature:
          run.temperature_degC[column.index].push_back(value);
          break;
        case Role::speed:
          run.spindle_rpm.push_back(value);
          break;
        case Role::feed:
          run.feed_mm_s.push_back(value);
          break;
        default:
          run.channel_mm[column.index].push_back(value);
          break;
      }
    }
  }

  // As the file has it; kNotRead where nothing stands or what stands there cannot be.
  double value_of(std::size_t i) {
    const double value = rows_.number_or_nan(i).value_or(kNotRead);
    if (!(std::abs(value) > columns_[i].largest)) return value;
    diagnostics_->error(rows_.file(), {rows_.line(), static_cast<std::uint32_t>(i + 1)},
                        "'" + shortest_text(value) + "' in column '" + rows_.columns()[i] + "' is beyond " +
                            shortest_text(columns_[i].largest));
    return kNotRead;
  }

  LogRun& run_of_row() {
    const std::string_view id = run_column_ ? rows_.fields()[*run_column_] : "1";
    if (!log_.runs.empty() && log_.runs[current_].id == id) return log_.runs[current_];
    const auto [it, added] = index_.try_emplace(std::string(id), log_.runs.size());
    current_ = it->second;
    if (added) {
      LogRun run;
      run.id = id;
      run.temperature_degC.resize(log_.sensors.size());
      run.sensor_file.assign(log_.sensors.size(), log_.file);
      run.channel_mm.resize(log_.channels.size());
      log_.runs.push_back(std::move(run));
    }
    return log_.runs[current_];
  }

  config::CsvRows rows_;
  Diagnostics* diagnostics_;
  Log log_;
  std::vector<LogColumn> columns_;
  std::optional<std::size_t> time_column_, run_column_;
  std::unordered_map<std::string, std::size_t> index_;
  std::size_t current_ = 0;
};

// Values of `from` at the rows of the joined time base; a value that is there already stays.
void join_column(const std::vector<std::size_t>& place, const std::vector<double>& from,
                 std::vector<double>& to) {
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!std::isnan(from[i])) to[place[i]] = from[i];
  }
}

// All columns of `run` moved to the rows of `time_s`, of which the run's own times are a part.
LogRun spread(const LogRun& run, const std::vector<double>& time_s,
              const std::vector<std::size_t>& sensor_place, const std::vector<std::size_t>& channel_place,
              const Log& names) {
  LogRun out;
  out.id = run.id;
  out.time_s = time_s;
  const std::vector<double> empty(time_s.size(), kNotRead);
  out.temperature_degC.assign(names.sensors.size(), empty);
  out.sensor_file.resize(names.sensors.size());
  for (std::size_t i = 0; i < run.sensor_file.size(); ++i)
    out.sensor_file[sensor_place[i]] = run.sensor_file[i];
  out.channel_mm.assign(names.channels.size(), empty);
  if (names.has_speed) out.spindle_rpm = empty;
  if (names.has_feed) out.feed_mm_s = empty;
  std::vector<std::size_t> place;
  for (const double t : run.time_s) {
    place.push_back(
        static_cast<std::size_t>(std::lower_bound(time_s.begin(), time_s.end(), t) - time_s.begin()));
  }
  for (std::size_t i = 0; i < run.temperature_degC.size(); ++i)
    join_column(place, run.temperature_degC[i], out.temperature_degC[sensor_place[i]]);
  for (std::size_t i = 0; i < run.channel_mm.size(); ++i)
    join_column(place, run.channel_mm[i], out.channel_mm[channel_place[i]]);
  join_column(place, run.spindle_rpm, out.spindle_rpm);
  join_column(place, run.feed_mm_s, out.feed_mm_s);
  return out;
}

std::vector<std::size_t> identity(std::size_t n) {
  std::vector<std::size_t> out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = i;
  return out;
}

// Adds the rows of `more` (already with the columns of `run`) to `run`.
void merge_into(LogRun& run, const LogRun& more) {
  for (std::size_t i = 0; i < run.temperature_degC.size(); ++i) {
    join_column(identity(more.rows()), more.temperature_degC[i], run.temperature_degC[i]);
    if (run.sensor_file[i].empty()) run.sensor_file[i] = more.sensor_file[i];
  }
  for (std::size_t i = 0; i < run.channel_mm.size(); ++i)
    join_column(identity(more.rows()), more.channel_mm[i], run.channel_mm[i]);
  join_column(identity(more.rows()), more.spindle_rpm, run.spindle_rpm);
  join_column(identity(more.rows()), more.feed_mm_s, run.feed_mm_s);
}

// The same time of a run in two files is one moment: what both say of it must be one value.
std::string contradiction_of(const std::string& what, const LogRun& a, const LogRun& b,
                             const std::vector<double>& of_a, const std::vector<double>& of_b) {
  std::size_t i = 0;
  for (std::size_t k = 0; k < of_b.size(); ++k) {
    while (i < a.rows() && a.time_s[i] < b.time_s[k]) ++i;
    if (i == a.rows()) break;
    if (a.time_s[i] != b.time_s[k] || std::isnan(of_a[i]) || std::isnan(of_b[k]) || of_a[i] == of_b[k])
      continue;
    return "run '" + a.id + "' has two values of " + what + " at " + shortest_text(b.time_s[k]) + " s, " +
           shortest_text(of_a[i]) + " and " + shortest_text(of_b[k]);
  }
  return "";
}

std::string contradiction_between(const Log& a, const Log& b) {
  for (const LogRun& run : b.runs) {
    const auto same =
        std::find_if(a.runs.begin(), a.runs.end(), [&](const LogRun& r) { return r.id == run.id; });
    if (same == a.runs.end()) continue;
    for (std::size_t k = 0; k < b.sensors.size(); ++k) {
      const auto i = a.sensor(b.sensors[k]);
      if (!i) continue;
      if (auto text = contradiction_of("sensor " + b.sensors[k], *same, run, same->temperature_degC[*i],
                                       run.temperature_degC[k]);
          !text.empty())
        return text;
    }
    for (std::size_t k = 0; k < b.channels.size(); ++k) {
      const auto i = a.channel(b.channels[k]);
      if (!i) continue;
      if (auto text = contradiction_of(b.channels[k], *same, run, same->channel_mm[*i], run.channel_mm[k]);
          !text.empty())
        return text;
    }
  }
  return "";
}

// What was measured once and stands there twice, under two names: it would be fitted and held out at once.
std::string copied_run(const Log& log) {
  constexpr std::size_t kFewest = 3;  // readings that differ: fewer may be alike by chance
  const auto same = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
  };
  const auto readings = [](const LogRun& run) {
    std::vector<double> out;
    for (const auto& channel : run.channel_mm)
      std::copy_if(channel.begin(), channel.end(), std::back_inserter(out),
                   [](double x) { return !std::isnan(x); });
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
  };
  const auto all_same = [&](const auto& a, const auto& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
  };
  for (std::size_t i = 0; i < log.runs.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const LogRun &a = log.runs[k], &b = log.runs[i];
      if (a.rows() != b.rows() || !all_same(a.channel_mm, b.channel_mm) ||
          !all_same(a.temperature_degC, b.temperature_degC) || readings(a).size() < kFewest)
        continue;
      return "run '" + b.id + "' has the readings and temperatures of run '" + a.id +
             "', row by row: one of them is a copy";
    }
  return "";
}

Log join(const Log& a, const Log& b) {
  Log out;
  out.file = a.file;
  out.sensors = a.sensors;
  out.channels = a.channels;
  out.has_speed = a.has_speed || b.has_speed;
  out.has_feed = a.has_feed || b.has_feed;
  std::vector<std::size_t> sensor_place, channel_place;
  for (const auto& name : b.sensors) sensor_place.push_back(index_of(out.sensors, name));
  for (const auto& name : b.channels) channel_place.push_back(index_of(out.channels, name));
  for (const LogRun& run : a.runs) {
    const auto it =
        std::find_if(b.runs.begin(), b.runs.end(), [&](const LogRun& r) { return r.id == run.id; });
    std::vector<double> time_s = run.time_s;
    if (it != b.runs.end()) {
      time_s.clear();
      std::set_union(run.time_s.begin(), run.time_s.end(), it->time_s.begin(), it->time_s.end(),
                     std::back_inserter(time_s));
    }
    out.runs.push_back(spread(run, time_s, identity(a.sensors.size()), identity(a.channels.size()), out));
    if (it != b.runs.end())
      merge_into(out.runs.back(), spread(*it, time_s, sensor_place, channel_place, out));
  }
  for (const LogRun& run : b.runs) {
    const bool known =
        std::any_of(a.runs.begin(), a.runs.end(), [&](const LogRun& r) { return r.id == run.id; });
    if (!known) out.runs.push_back(spread(run, run.time_s, sensor_place, channel_place, out));
  }
  return out;
}

std::string number_or_empty(double value, int decimals) {
  return std::isnan(value) ? "" : fixed_text(value, decimals);
}

}  // namespace

std::optional<std::size_t> Log::sensor(std::string_view name) const {
  const auto it = std::find(sensors.begin(), sensors.end(), name);
  return it == sensors.end() ? std::nullopt : std::optional<std::size_t>(it - sensors.begin());
}

std::optional<std::size_t> Log::channel(std::string_view name) const {
  const auto it = std::find(channels.begin(), channels.end(), name);
  return it == channels.end() ? std::nullopt : std::optional<std::size_t>(it - channels.begin());
}

std::string sensor_file(const LogRun& run, std::size_t sensor, const Log& log) {
  return sensor < run.sensor_file.size() ? run.sensor_file[sensor] : log.file;
}

Result<Log> parse_log(std::string_view text, const std::string& file, Diagnostics& diagnostics) {
  Diagnostics own;
  LogReader reader(text, file, own);
  if (!own.has_errors()) reader.read();
  diagnostics.append(own);
  if (own.has_errors()) return tl::unexpected(own.first_error());
  return reader.take();
}

Result<Log> load_logs(const std::vector<std::string>& paths, Diagnostics& diagnostics) {
  std::optional<Log> joined;
  for (const std::string& path : paths) {
    const auto text = read_file(path);
    if (!text) return tl::unexpected(text.error());
    auto log = parse_log(*text, path, diagnostics);
    if (!log) return tl::unexpected(log.error());
    if (joined) {
      if (const std::string wrong = contradiction_between(*joined, *log); !wrong.empty())
        return fail(ErrorCode::wrong_input,
                    wrong + " (" + joined->file + "): two days under one name? Give each run its own run_id",
                    path);
    }
    joined = joined ? join(*joined, *log) : std::move(*log);
  }
  if (!joined) return fail(ErrorCode::wrong_use, "no log file given");
  if (const std::string text = copied_run(*joined); !text.empty())
    return fail(ErrorCode::wrong_input, text, paths.size() == 1 ? paths.front() : std::string());
  return std::move(*joined);
}

std::string log_text(const Log& log, const std::vector<std::string>& comments) {
  std::string out;
  for (const std::string& comment : comments) out.append("#").append(printable(comment, "\t")).append("\n");
  out += "run_id,time_s";
  for (const auto& name : log.sensors) out += ",T_" + name + "_degC";
  if (log.has_speed) out += ",spindle_rpm";
  if (log.has_feed) out += ",feed_mm_min";
  for (const auto& name : log.channels) out += "," + name + "_um";
  out += "\n";
  for (const LogRun& run : log.runs) {
    for (std::size_t row = 0; row < run.rows(); ++row) {
      out += config::csv_field(run.id) + "," + shortest_text(run.time_s[row]);
      for (const auto& column : run.temperature_degC) out += "," + number_or_empty(column[row], 3);
      if (log.has_speed) out += "," + number_or_empty(run.spindle_rpm[row], 1);
      if (log.has_feed) out += "," + number_or_empty(run.feed_mm_s[row] * kSecondsPerMinute, 1);
      for (const auto& column : run.channel_mm) out += "," + number_or_empty(column[row] / kMmPerUm, 3);
      out += "\n";
    }
  }
  return out;
}

}  // namespace trunnion::thermal
