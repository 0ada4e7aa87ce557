#pragma once
#include <string>
#include <string_view>

#include "trunnion/base/diagnostics.hpp"

namespace trunnion::diagnosis {

struct MapImport {
  double u_random_um = 0.05;  // assumed where the file does not say: a two-dimensional laser or grid scale
  std::size_t parts = 4;      // runs that the points are dealt to in turn, so that some can be held out
};
/// A two-dimensional map (lines `x, y, error along X, error along Y`; mm, um; actual minus nominal) as a
/// measurement file with X, Y and Z columns.
Result<std::string> import_map(std::string_view text, const std::string& file, const MapImport& options,
                               Diagnostics& diagnostics);

struct LogImport {
  std::string channel;  // column of the displacement, um
  std::string direction = "X";
  double u_random_um = 0.5;  // assumed where the file does not say
  double step_s = 60.0;      // between rows that are only counted
  std::size_t every = 1;     // keep each n-th reading; the rows between stay as state
};
/// A temperature log (`time_s` or `sample`, `day` or `run_id`, temperatures `<name>_C` or `T_<name>_degC`,
/// `spindle_rpm`) with one displacement channel as a measurement file of a machine standing at X = Y = Z = 0.
Result<std::string> import_log(std::string_view text, const std::string& file, const LogImport& options,
                               Diagnostics& diagnostics);

}  // namespace trunnion::diagnosis
