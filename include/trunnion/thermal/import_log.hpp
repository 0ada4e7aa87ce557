#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/thermal/log.hpp"

namespace trunnion::thermal {

/// Which columns of another program's CSV file are what. A column is a sensor when its name ends in `_C` or
/// `_degC`, a channel when it ends in `_um` or is named in `channels`; anything else that is not named here
/// is left out.
struct ImportOptions {
  std::string time_column = "time_s";
  double seconds_per_count = 1.0;  // 120 where the column counts samples of two minutes
  std::string run_column;          // a new run at each new value; empty: one run
  std::string speed_column = "spindle_rpm";
  bool run_starts_with_spindle =
      false;  // a new run whenever the speed rises from zero; rows before the first start are left out
  std::vector<std::string> channels;  // columns without unit in their name
  double um_per_count = 1.0;          // of those
};

/// Reads a foreign log; times count from the start of each run.
Result<Log> import_log(std::string_view text, const std::string& file, const ImportOptions& options,
                       Diagnostics& diagnostics);

}  // namespace trunnion::thermal
