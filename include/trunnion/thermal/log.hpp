#pragma once
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"

namespace trunnion::thermal {

/// In a column: nothing was read at that time.
inline constexpr double kNotRead = std::numeric_limits<double>::quiet_NaN();

/// Beyond these nothing turns, moves or errs: a value in another unit, or none at all.
inline constexpr double kFastestSpindle_rpm = 1e6;
inline constexpr double kFastestFeed_mm_min = 1e7;
inline constexpr double kLargestDeviation_um = 1e6;

/// One warm-up, day or impeller: the unit that is held out. Columns have one value per entry of `time_s`;
/// kNotRead where nothing was read (rates may differ).
struct LogRun {
  std::string id;
  std::vector<double> time_s;                         // strictly increasing
  std::vector<std::vector<double>> temperature_degC;  // [sensor][row]
  std::vector<double> spindle_rpm;                    // empty when the log has no such column
  std::vector<double> feed_mm_s;                      // empty when the log has no such column
  std::vector<std::vector<double>> channel_mm;        // [channel][row], measured deviations
  std::vector<std::string> sensor_file;               // [sensor], where its readings come from

  std::size_t rows() const { return time_s.size(); }
};

/// Temperatures, speed and measured channels of several runs; every run has the same columns.
struct Log {
  std::string file;
  std::vector<std::string> sensors;   // `x` of T_<x>_degC
  std::vector<std::string> channels;  // `x` of <x>_um
  bool has_speed = false;
  bool has_feed = false;
  std::vector<LogRun> runs;

  std::optional<std::size_t> sensor(std::string_view name) const;
  std::optional<std::size_t> channel(std::string_view name) const;
};

/// The file that the readings of a sensor in a run come from.
std::string sensor_file(const LogRun& run, std::size_t sensor, const Log& log);

/// Reads `run_id` (default: one run), `time_s`, `T_<name>_degC`, [`spindle_rpm`], [`feed_mm_min`],
/// `<channel>_um`. Any other column is an error (a misspelt unit is never ignored). Time must increase within
/// a run; a run's rows need not be adjacent. Speeds, feeds and deviations beyond the limits above are errors.
Result<Log> parse_log(std::string_view text, const std::string& file, Diagnostics& diagnostics);

/// Reads several files; rows of the same run_id in different files are joined by time (temperatures in one
/// file, displacements in another).
Result<Log> load_logs(const std::vector<std::string>& paths, Diagnostics& diagnostics);

/// CSV text of the log in the same format.
std::string log_text(const Log& log, const std::vector<std::string>& comments);

}  // namespace trunnion::thermal
