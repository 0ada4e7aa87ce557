#include <algorithm>
#include <cmath>

#include "trunnion/thermal/condition.hpp"

// What a model can be fitted to: runs and sensors of a log.

namespace trunnion::thermal {
namespace {

std::size_t readings_in(const std::vector<double>& column) {
  return static_cast<std::size_t>(
      std::count_if(column.begin(), column.end(), [](double v) { return !std::isnan(v); }));
}

// Whether a sensor must not be leant on because of a fault; `column` is what is left of it in that run.
bool spoils(const SensorFault& fault, const std::vector<double>& column) {
  constexpr double kFewOutOfRange = 0.05;
  const auto good = static_cast<double>(readings_in(column));
  const auto bad = static_cast<double>(fault.readings);
  return fault.kind == FaultKind::stuck || fault.kind == FaultKind::jump ||
         (fault.kind == FaultKind::out_of_range && bad > kFewOutOfRange * (good + bad)) ||
         (fault.kind == FaultKind::gap && good == 0.0);
}

bool is_kept(const std::vector<std::string>& keep, const std::string& sensor) {
  return std::any_of(keep.begin(), keep.end(),
                     [&](const std::string& k) { return k == sensor || k == "all"; });
}

// The first fault that spoils a sensor in a run; null where there is none.
const SensorFault* spoilt(const LogRun& run, const std::vector<double>& column, const std::string& sensor,
                          const std::vector<SensorFault>& faults) {
  const auto it = std::find_if(faults.begin(), faults.end(), [&](const SensorFault& f) {
    return f.run == run.id && f.sensor == sensor && spoils(f, column);
  });
  return it == faults.end() ? nullptr : &*it;
}

// Why a run teaches nothing: a fault of its first sensor where each of them is spoilt; null where one is not.
const SensorFault* all_spoilt(const Log& log, const LogRun& run, const std::vector<SensorFault>& faults,
                              const std::vector<std::string>& keep) {
  const SensorFault* why = nullptr;
  for (std::size_t s = 0; s < log.sensors.size(); ++s) {
    const auto& column = run.temperature_degC[s];
    const SensorFault* fault = spoilt(run, column, log.sensors[s], faults);
    // Who keeps a sensor means its readings: where there are none nothing is kept.
    if (fault == nullptr || (is_kept(keep, log.sensors[s]) && readings_in(column) > 0)) return nullptr;
    if (why == nullptr) why = fault;
  }
  return why;
}

}  // namespace

std::vector<LeftOut> judge_sensors(const Log& log, const std::vector<SensorFault>& faults,
                                   const std::vector<std::string>& keep) {
  std::vector<LeftOut> out;
  for (std::size_t s = 0; s < log.sensors.size(); ++s) {
    if (is_kept(keep, log.sensors[s])) continue;
    for (const LogRun& run : log.runs) {
      const SensorFault* fault = spoilt(run, run.temperature_degC[s], log.sensors[s], faults);
      if (fault == nullptr) continue;
      out.push_back({log.sensors[s], sensor_file(run, s, log), fault->text()});
      break;
    }
  }
  return out;
}

Log without_sensors(const Log& log, const std::vector<LeftOut>& left_out) {
  Log out = log;
  for (std::size_t s = log.sensors.size(); s-- > 0;) {
    const auto named = [&](const LeftOut& l) { return l.sensor == log.sensors[s]; };
    if (std::none_of(left_out.begin(), left_out.end(), named)) continue;
    const auto at = static_cast<std::ptrdiff_t>(s);
    out.sensors.erase(out.sensors.begin() + at);
    for (LogRun& run : out.runs) {
      run.temperature_degC.erase(run.temperature_degC.begin() + at);
      if (!run.sensor_file.empty()) run.sensor_file.erase(run.sensor_file.begin() + at);
    }
  }
  return out;
}

Result<Log> usable_for_fit(const Log& log, const std::vector<SensorFault>& faults,
                           const std::vector<std::string>& keep, Diagnostics& diagnostics) {
  Log out = log;
  std::string first;
  std::erase_if(out.runs, [&](const LogRun& run) {
    const SensorFault* fault = all_spoilt(log, run, faults, keep);
    if (fault == nullptr) return false;
    if (first.empty()) first = fault->text();
    diagnostics.warning(
        sensor_file(run, *log.sensor(fault->sensor), log), {},
        "run '" + run.id + "' is left out, since none of its sensors can be used: " + fault->text());
    return true;
  });
  if (out.runs.empty())
    return fail(ErrorCode::wrong_input, "no run is left: none has a sensor that can be used (" + first + ")",
                log.file);
  const auto left_out = judge_sensors(out, faults, keep);
  for (const LeftOut& l : left_out)
    diagnostics.warning(
        l.file, {},
        "sensor '" + l.sensor + "' is left out (--keep-sensors " + l.sensor + " keeps it): " + l.why);
  return without_sensors(out, left_out);
}

}  // namespace trunnion::thermal
