#include "trunnion/thermal/condition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/thermal/features.hpp"

#include "thermal/start.hpp"
#include "thermal/stuck.hpp"

namespace trunnion::thermal {
namespace {

// Rows at which a column has a reading.
std::vector<std::size_t> readings_of(const std::vector<double>& column) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!std::isnan(column[i])) out.push_back(i);
  }
  return out;
}

class Checker {
 public:
  Checker(const LogRun& run, std::size_t sensor, const std::string& name, const SensorLimits& limits,
          std::vector<SensorFault>& faults)
      : run_(&run), sensor_(sensor), name_(&name), limits_(&limits), faults_(&faults) {}

  /// The column without what cannot be true.
  std::vector<double> check() {
    std::vector<double> column = run_->temperature_degC[sensor_];
    take_out_of_range(column);
    take_wrong_start(column);
    take_jumps(column);
    report_gaps(column);
    return column;
  }

 private:
  double time(std::size_t row) const { return run_->time_s[row]; }
  void report(FaultKind kind, std::size_t from, std::size_t to, std::size_t readings) {
    faults_->push_back({run_->id, *name_, kind, time(from), time(to), readings, {}});
  }

  void take_out_of_range(std::vector<double>& column) {
    std::size_t first = 0, last = 0, count = 0;
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (std::isnan(column[i]) || is_plausible(column[i])) continue;
      if (count++ == 0) first = i;
      last = i;
      column[i] = kNotRead;
    }
    if (count > 0) report(FaultKind::out_of_range, first, last, count);
  }

  static constexpr double kSlow_s = 60.0;
  static constexpr std::size_t kSpike = 5;  // readings

  // The rises of the run count from its first reading: that one is judged by those behind it.
  void take_wrong_start(std::vector<double>& column) {
    const auto rows = readings_of(column);
    std::vector<TimedReading> start;
    for (const std::size_t row : rows) {
      if (time(row) - time(rows.front()) > kStartAtMost_s) break;
      start.push_back({time(row), column[row]});
    }
    if (const std::size_t count = start_of(start); count > 0) start.resize(count);
    take_out_first(column, rows, wrong_at_start(start));
  }

  void take_out_first(std::vector<double>& column, const std::vector<std::size_t>& rows, std::size_t count) {
    if (count == 0) return;
    report(FaultKind::spike, rows.front(), rows[count - 1], count);
    for (std::size_t i = 0; i < count; ++i) column[rows[i]] = kNotRead;
  }

  bool apart(const std::vector<double>& column, std::size_t a, std::size_t b, double within_s) const {
    return time(b) - time(a) <= within_s && std::abs(column[b] - column[a]) > limits_->max_jump_K;
  }

  // A reading that leaves and comes back is a spike; one that stays away is a jump, and nothing after it can
  // be believed. Where more comes after it than before, at the very start of the run, it is what was before
  // that cannot be.
  void take_jumps(std::vector<double>& column) {
    const auto rows = readings_of(column);
    // So long no structure moves by as much as a jump and stands again.
    constexpr double kAway_s = static_cast<double>(kSpike + 1) * kSlow_s;
    std::size_t good = 0;  // index into rows of the last good reading
    for (std::size_t k = 1; k < rows.size(); ++k) {
      if (!apart(column, rows[good], rows[k], kSlow_s)) {
        good = k;
        continue;
      }
      std::size_t back = k + 1;
      while (back < rows.size() && back <= k + kSpike && apart(column, rows[good], rows[back], kAway_s))
        ++back;
      const bool spike = back < rows.size() && back <= k + kSpike;
      const bool at_start = time(rows[k]) - time(rows.front()) <= kStartAtMost_s && 2 * k < rows.size();
      if (!spike && at_start) {
        take_out_first(column, rows, k);
        good = k;
        continue;
      }
      const std::size_t end = spike ? back : rows.size();
      report(spike ? FaultKind::spike : FaultKind::jump, rows[k], rows[end - 1], end - k);
      for (std::size_t i = k; i < end; ++i) column[rows[i]] = kNotRead;
      if (!spike) return;
      good = back;
      k = back;
    }
  }

  void report_gaps(const std::vector<double>& column) {
    const auto rows = readings_of(column);
    if (rows.empty()) {
      if (!column.empty()) report(FaultKind::gap, 0, column.size() - 1, 0);
      return;
    }
    std::vector<double> steps;
    for (std::size_t k = 1; k < rows.size(); ++k) steps.push_back(time(rows[k]) - time(rows[k - 1]));
    double usual = 0.0;
    if (!steps.empty()) {
      const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
      std::nth_element(steps.begin(), middle, steps.end());
      usual = *middle;
    }
    // A sensor that is read seldom has no gaps at its own rate.
    const double longest = std::max(limits_->gap_s, 3.0 * usual);
    for (std::size_t k = 1; k < rows.size(); ++k) {
      if (time(rows[k]) - time(rows[k - 1]) > longest) report(FaultKind::gap, rows[k - 1], rows[k], 0);
    }
    // What was taken out was told.
    const auto& raw = run_->temperature_degC[sensor_];
    const bool silent = rows.back() == readings_of(raw).back();
    if (silent && time(raw.size() - 1) - time(rows.back()) > longest) {
      report(FaultKind::gap, rows.back(), raw.size() - 1, 0);
      faults_->back().why = "silent to the end of the run";
    }
  }

  const LogRun* run_;
  std::size_t sensor_;
  const std::string* name_;
  const SensorLimits* limits_;
  std::vector<SensorFault>* faults_;
};

// Means over the rows [bounds[i], bounds[i + 1]) of what was read.
std::vector<double> means(const std::vector<double>& column, const std::vector<std::size_t>& bounds) {
  if (column.empty()) return {};
  std::vector<double> out;
  for (std::size_t i = 0; i + 1 < bounds.size(); ++i) {
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t row = bounds[i]; row < bounds[i + 1]; ++row) {
      if (std::isnan(column[row])) continue;
      sum += column[row];
      count += 1.0;
    }
    out.push_back(count > 0.0 ? sum / count : kNotRead);
  }
  return out;
}

// One line for each run whose spindle speed is not known for a while.
void tell_unknown_speed(const Log& log, const LogRun& run, Diagnostics& diagnostics) {
  double unknown_s = 0.0;
  double read_s = run.rows() > 0 ? run.time_s.front() : 0.0;
  bool empty = false;  // a row since then has no speed
  for (std::size_t row = 0; row < run.rows(); ++row) {
    const bool here = !std::isnan(run.spindle_rpm[row]);
    empty = empty || !here;
    if (!here && row + 1 < run.rows()) continue;
    const double silent_s = run.time_s[row] - read_s;
    if (empty && silent_s > kDriveHeld_s) unknown_s += silent_s;
    read_s = run.time_s[row];
    empty = false;
  }
  if (!(unknown_s > 0.0)) return;
  diagnostics.warning(log.file, {},
                      "run '" + run.id + "': spindle_rpm is empty for " +
                          fixed_text(unknown_s / kSecondsPerMinute, 0) + " of " +
                          fixed_text((run.time_s.back() - run.time_s.front()) / kSecondsPerMinute, 0) +
                          " min: unknown there, not 0");
}

// What a sensor may have been read in that begins the day at so many "degrees Celsius".
std::string question_of_unit(double degC) {
  // A workshop of 10 to 43 degC in degrees Fahrenheit, and of -23 to 57 degC in kelvin.
  constexpr double kMostFahrenheit = 110.0;
  constexpr double kLeastKelvin = 250.0, kMostKelvin = 330.0;
  if (degC <= kMostFahrenheit) return "are these degrees Fahrenheit?";
  if (degC >= kLeastKelvin && degC <= kMostKelvin) return "are these kelvin?";
  return "in which unit are these?";
}

// Units that no workshop has: a line for each run that looks like degrees Fahrenheit or minutes.
void tell_doubtful_units(const Log& log, const LogRun& run, Diagnostics& diagnostics) {
  constexpr double kWarmShop_degC = 45.0;
  constexpr double kShort_s = 600.0;
  constexpr double kFast_K = 5.0;
  constexpr std::size_t kManyRows = 100;
  double coldest_degC = std::numeric_limits<double>::infinity();
  std::size_t fast = 0;
  for (const auto& column : run.temperature_degC) {
    double first = kNotRead;
    double furthest_K = 0.0;
    for (const double value : column) {
      if (std::isnan(value)) continue;
      if (std::isnan(first)) first = value;
      furthest_K = std::max(furthest_K, std::abs(value - first));
    }
    if (first < coldest_degC) coldest_degC = first;
    if (furthest_K > kFast_K) ++fast;
  }
  if (std::isfinite(coldest_degC) && coldest_degC > kWarmShop_degC)
    diagnostics.warning(log.file, {},
                        "run '" + run.id + "': the coldest sensor begins at " + fixed_text(coldest_degC, 1) +
                            " degC: " + question_of_unit(coldest_degC));
  const double lasts_s = run.rows() > 0 ? run.time_s.back() - run.time_s.front() : 0.0;
  if (run.rows() >= kManyRows && lasts_s < kShort_s && fast >= 2)
    diagnostics.warning(log.file, {},
                        "run '" + run.id + "': " + std::to_string(fast) +
                            " sensors move by more than 5 K within " + fixed_text(lasts_s, 0) +
                            " s: is the time in minutes?");
}

}  // namespace

std::string fault_name(FaultKind kind) {
  constexpr const char* kNames[] = {"out of range", "spike", "jump", "stuck", "gap"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string SensorFault::text() const {
  return "run '" + run + "', sensor '" + sensor + "': " + fault_name(kind) + " from " +
         shortest_text(from_s) + " s to " + shortest_text(to_s) + " s (" + std::to_string(readings) +
         " readings)" + (why.empty() ? "" : ": " + why);
}

Log without_faults(const Log& log, const SensorLimits& limits, std::vector<SensorFault>& faults) {
  Log out = log;
  for (std::size_t r = 0; r < log.runs.size(); ++r) {
    for (std::size_t s = 0; s < log.sensors.size(); ++s) {
      out.runs[r].temperature_degC[s] = Checker(log.runs[r], s, log.sensors[s], limits, faults).check();
    }
  }
  report_stuck(out, limits, faults);
  return out;
}

Log resampled(const Log& log, double step_s) {
  Log out = log;
  for (LogRun& run : out.runs) {
    if (run.rows() < 2) continue;
    const double usual_s = (run.time_s.back() - run.time_s.front()) / static_cast<double>(run.rows() - 1);
    if (usual_s >= step_s) continue;
    std::vector<std::size_t> bounds = {0};
    const auto interval = [&](std::size_t row) {
      return std::floor((run.time_s[row] - run.time_s.front()) / step_s);
    };
    for (std::size_t row = 1; row < run.rows(); ++row) {
      if (interval(row) != interval(row - 1)) bounds.push_back(row);
    }
    bounds.push_back(run.rows());
    for (auto& column : run.temperature_degC) column = means(column, bounds);
    for (auto& column : run.channel_mm) column = means(column, bounds);
    run.spindle_rpm = means(run.spindle_rpm, bounds);
    run.feed_mm_s = means(run.feed_mm_s, bounds);
    run.time_s = means(run.time_s, bounds);
  }
  return out;
}

void tell_faults(const Log& log, const std::vector<SensorFault>& faults, Diagnostics& diagnostics) {
  struct Told {
    const SensorFault* first;
    std::string file;
    std::size_t times = 0, readings = 0;
    std::set<std::string> runs;
  };
  std::vector<Told> lines;
  for (const SensorFault& fault : faults) {
    const auto run =
        std::find_if(log.runs.begin(), log.runs.end(), [&](const LogRun& r) { return r.id == fault.run; });
    const std::string file = sensor_file(*run, *log.sensor(fault.sensor), log);
    auto line = std::find_if(lines.begin(), lines.end(), [&](const Told& t) {
      return t.first->sensor == fault.sensor && t.first->kind == fault.kind && t.file == file;
    });
    if (line == lines.end()) line = lines.insert(lines.end(), {&fault, file, 0, 0, {}});
    ++line->times;
    line->readings += fault.readings;
    line->runs.insert(fault.run);
  }
  for (const Told& line : lines) {
    std::string text = line.first->text();
    if (line.times > 1) {
      text += "; " + std::to_string(line.times) + " times in " + std::to_string(line.runs.size()) +
              (line.runs.size() == 1 ? " run, " : " runs, ") + std::to_string(line.readings) +
              " readings in all";
    }
    diagnostics.warning(line.file, {}, text);
  }
}

Result<Log> load_conditioned_logs(const std::vector<std::string>& paths, Diagnostics& diagnostics,
                                  std::vector<SensorFault>& faults) {
  const auto raw = load_logs(paths, diagnostics);
  if (!raw) return tl::unexpected(raw.error());
  Log out = resampled(without_faults(*raw, SensorLimits{}, faults), kLogStep_s);
  tell_faults(*raw, faults, diagnostics);
  for (const LogRun& run : raw->runs) tell_doubtful_units(*raw, run, diagnostics);
  if (raw->has_speed) {
    for (const LogRun& run : raw->runs) tell_unknown_speed(*raw, run, diagnostics);
  }
  return out;
}

}  // namespace trunnion::thermal
