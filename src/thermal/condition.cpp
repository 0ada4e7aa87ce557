#include "trunnion/thermal/condition.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/thermal/features.hpp"

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
    take_jumps(column);
    report_stuck(column);
    report_gaps(column);
    return column;
  }

 private:
  double time(std::size_t row) const { return run_->time_s[row]; }
  void report(FaultKind kind, std::size_t from, std::size_t to, std::size_t readings) {
    faults_->push_back({run_->id, *name_, kind, time(from), time(to), readings});
  }

  void take_out_of_range(std::vector<double>& column) {
    std::size_t first = 0, last = 0, count = 0;
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (std::isnan(column[i]) || (column[i] >= limits_->min_degC && column[i] <= limits_->max_degC))
        continue;
      if (count++ == 0) first = i;
      last = i;
      column[i] = kNotRead;
    }
    if (count > 0) report(FaultKind::out_of_range, first, last, count);
  }

  bool jumps(const std::vector<double>& column, std::size_t a, std::size_t b) const {
    constexpr double kSlow_s = 60.0;
    return time(b) - time(a) <= kSlow_s && std::abs(column[b] - column[a]) > limits_->max_jump_K;
  }

  // A reading that leaves and comes back is a spike; one that stays away is a jump, and nothing after it can
  // be believed.
  void take_jumps(std::vector<double>& column) {
    const auto rows = readings_of(column);
    std::size_t good = 0;  // index into rows of the last good reading
    for (std::size_t k = 1; k < rows.size(); ++k) {
      if (!jumps(column, rows[good], rows[k])) {
        good = k;
        continue;
      }
      constexpr std::size_t kSpike = 5;  // readings
      std::size_t back = k + 1;
      while (back < rows.size() && back <= k + kSpike && jumps(column, rows[good], rows[back])) ++back;
      const bool spike = back < rows.size() && back <= k + kSpike;
      const std::size_t end = spike ? back : rows.size();
      report(spike ? FaultKind::spike : FaultKind::jump, rows[k], rows[end - 1], end - k);
      for (std::size_t i = k; i < end; ++i) column[rows[i]] = kNotRead;
      if (!spike) return;
      good = back;
      k = back;
    }
  }

  // Largest change of any other sensor between two rows.
  double others_moved(std::size_t from, std::size_t to) const {
    double out = 0.0;
    for (std::size_t s = 0; s < run_->temperature_degC.size(); ++s) {
      if (s == sensor_) continue;
      const double change = std::abs(run_->temperature_degC[s][to] - run_->temperature_degC[s][from]);
      if (change > out) out = change;
    }
    return out;
  }

  void report_stuck(const std::vector<double>& column) {
    const auto rows = readings_of(column);
    std::size_t begin = 0;
    for (std::size_t k = 1; k <= rows.size(); ++k) {
      if (k < rows.size() && column[rows[k]] == column[rows[begin]]) continue;
      const std::size_t from = rows.empty() ? 0 : rows[begin];
      const std::size_t to = rows.empty() ? 0 : rows[k - 1];
      if (k - begin > 2 && time(to) - time(from) >= limits_->stuck_s &&
          others_moved(from, to) >= limits_->stuck_while_other_K) {
        report(FaultKind::stuck, from, to, k - begin);
      }
      begin = k;
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

}  // namespace

std::string fault_name(FaultKind kind) {
  constexpr const char* kNames[] = {"out of range", "spike", "jump", "stuck", "gap"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string SensorFault::text() const {
  return "run '" + run + "', sensor '" + sensor + "': " + fault_name(kind) + " from " +
         shortest_text(from_s) + " s to " + shortest_text(to_s) + " s (" + std::to_string(readings) +
         " readings)";
}

Log without_faults(const Log& log, const SensorLimits& limits, std::vector<SensorFault>& faults) {
  Log out = log;
  for (std::size_t r = 0; r < log.runs.size(); ++r) {
    for (std::size_t s = 0; s < log.sensors.size(); ++s) {
      out.runs[r].temperature_degC[s] = Checker(log.runs[r], s, log.sensors[s], limits, faults).check();
    }
  }
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

Log without_faulty_sensors(const Log& log, const std::vector<SensorFault>& faults,
                           std::vector<std::string>& left_out) {
  Log out = log;
  for (std::size_t s = log.sensors.size(); s-- > 0;) {
    // A spike was taken out and a gap is bridged: neither spoils the sensor.
    const bool faulty = std::any_of(faults.begin(), faults.end(), [&](const SensorFault& f) {
      return f.sensor == log.sensors[s] && f.kind != FaultKind::spike &&
             !(f.kind == FaultKind::gap && f.from_s < f.to_s);
    });
    if (!faulty) continue;
    left_out.push_back(log.sensors[s]);
    out.sensors.erase(out.sensors.begin() + static_cast<std::ptrdiff_t>(s));
    for (LogRun& run : out.runs)
      run.temperature_degC.erase(run.temperature_degC.begin() + static_cast<std::ptrdiff_t>(s));
  }
  return out;
}

Result<Log> load_conditioned_logs(const std::vector<std::string>& paths, Diagnostics& diagnostics,
                                  std::vector<SensorFault>& faults) {
  const auto raw = load_logs(paths, diagnostics);
  if (!raw) return tl::unexpected(raw.error());
  Log out = resampled(without_faults(*raw, SensorLimits{}, faults), kLogStep_s);
  for (const SensorFault& fault : faults) diagnostics.warning(raw->file, {}, fault.text());
  if (raw->has_speed) {
    for (const LogRun& run : raw->runs) tell_unknown_speed(*raw, run, diagnostics);
  }
  return out;
}

}  // namespace trunnion::thermal
