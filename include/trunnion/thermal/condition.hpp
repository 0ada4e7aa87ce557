#pragma once
#include <string>
#include <vector>

#include "trunnion/thermal/log.hpp"

namespace trunnion::thermal {

/// Of a workshop: a broken wire reads far beyond.
inline bool is_plausible(double degC) {
  return degC >= -30.0 && degC <= 150.0;
}

/// What a temperature sensor must not do. Structures of machines weigh; they do not jump.
struct SensorLimits {
  double max_jump_K = 5.0;  // between two readings at most a minute apart
  /// The same reading to the last digit for so long while another sensor moved by so much is looked at: it is
  /// stuck when the other sensors let expect a change of at least `stuck_least_K`, and more than its own
  /// steps and the scatter of that expectation explain (stuck.hpp).
  double stuck_s = 3600.0;
  double stuck_while_other_K = 2.0;
  double stuck_least_K = 0.5;
  double gap_s = 300.0;  // readings further apart are reported; in between the last one holds
};

enum class FaultKind { out_of_range, spike, jump, stuck, gap };
std::string fault_name(FaultKind kind);

/// Something wrong with one sensor of one run.
struct SensorFault {
  std::string run, sensor;
  FaultKind kind = FaultKind::gap;
  double from_s = 0.0, to_s = 0.0;
  std::size_t readings = 0;  // that were taken out (or, for stuck and gap, that are in question)
  std::string why = {};      // what speaks for it, where the kind does not say it
  std::string text() const;
};

/// Takes out readings that cannot be true: out of range, single spikes, and everything after a jump that
/// stays. Stuck sensors and gaps are only reported. They are appended to `faults`.
Log without_faults(const Log& log, const SensorLimits& limits, std::vector<SensorFault>& faults);

/// Means over intervals of `step_s` counted from the start of each run, at the mean time of their rows; a log
/// whose rows are further apart stays as it is. Spindle speed and feed are averaged too (heat follows their
/// mean).
Log resampled(const Log& log, double step_s);

/// A sensor that a model must not lean on, and why; the file is the one whose readings speak against it.
struct LeftOut {
  std::string sensor, file, why;
};
/// Sensors that are stuck, jump and stay there, are out of range in more than a twentieth of a run's
/// readings, or are not read in a whole run. Single spikes were taken out and gaps are bridged: neither
/// spoils a sensor.
/// @param keep  names that are kept whatever was found; `all` keeps every one
std::vector<LeftOut> judge_sensors(const Log& log, const std::vector<SensorFault>& faults,
                                   const std::vector<std::string>& keep);
Log without_sensors(const Log& log, const std::vector<LeftOut>& left_out);

/// The log that a model is fitted to: without runs of which no sensor can be used (of a day in kelvin, the
/// day is at fault and not its sensors), then without the sensors of `judge_sensors`; both told as warnings.
/// Fails when no run is left.
Result<Log> usable_for_fit(const Log& log, const std::vector<SensorFault>& faults,
                           const std::vector<std::string>& keep, Diagnostics& diagnostics);

/// Faults for people: one line for each sensor and kind of fault, with its file.
void tell_faults(const Log& log, const std::vector<SensorFault>& faults, Diagnostics& diagnostics);

/// Logs as models want them: joined, without faults (told as warnings), resampled to kLogStep_s.
inline constexpr double kLogStep_s =
    15.0;  // structures do not move in less, and noise falls with the root of the number
Result<Log> load_conditioned_logs(const std::vector<std::string>& paths, Diagnostics& diagnostics,
                                  std::vector<SensorFault>& faults);

}  // namespace trunnion::thermal
