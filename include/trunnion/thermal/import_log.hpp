#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/thermal/log.hpp"

namespace trunnion::thermal {

/// Which columns of another program's table are what. A column is a sensor when it matches a pattern of
/// `sensors` or its name ends in `_C` or `_degC`, a channel when it matches one of `channels` or ends in
/// `_um`; anything else that is not named here is left out and told.
struct ImportOptions {
  /// Empty: `time_s`, else the first of time, timestamp, datetime, date, zeit (any case, with a unit or
  /// without). Dates and times of the day (ISO 8601, 31.12.2024 07:30:00) are read as such.
  std::string time_column;
  /// 120 where the column counts samples of two minutes. Not given: the unit that its name has (`time_ms`,
  /// `Time [min]`), else seconds, with a warning.
  std::optional<double> seconds_per_count;
  std::optional<double> step_s;  // a file without a time: rows are so far apart
  std::string run_column;        // a new run at each new value; empty: one run
  std::string speed_column = "spindle_rpm";
  bool run_starts_with_spindle =
      false;  // a new run whenever the speed rises from zero; rows before the first start are left out
  std::vector<std::string> sensors;   // shell patterns (`PT*`) of columns in degrees Celsius
  std::vector<std::string> channels;  // shell patterns of columns in um, in mm where their name ends in `_mm`
  double um_per_count = 1.0;          // of those
  char delimiter = 0;                 // 0: what the header has
  std::size_t skip_lines = 0;         // before the header
  bool part = false;                  // a file of sensors only, or of channels only, is right
};

/// Reads a foreign log: any delimiter, decimal commas, N/A and the like for what was not read. Times count
/// from the start of each run. Columns that were not taken are notes. Fails where no sensor or no channel was
/// taken.
Result<Log> import_log(std::string_view text, const std::string& file, const ImportOptions& options,
                       Diagnostics& diagnostics);

}  // namespace trunnion::thermal
