#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/machine/machine.hpp"

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

struct StageImport {
  std::vector<std::string>
      axes;                   // of this machine: the file's first and second; empty: as the file names them
  double u_random_um = 0.05;  // assumed: the file does not say
  std::size_t parts = 4;      // as of a map
};
/// What Aerotech's programs for two axes of a stage write (`.dat`): `:START` behind a header of `key :
/// value`, columns Position1, LaserData1, Position2, LaserData2 (mm; the error is the laser's position less
/// the commanded one); or a header of `%` lines, columns Ax1CmdPos, Ax2CmdPos, Ax1RelErr, Ax2RelErr in
/// UserUnits. Readings are along the positive sense of each axis; which way that is in M follows from
/// `machine`.
Result<std::string> import_stage(std::string_view text, const std::string& file, const Machine& machine,
                                 const StageImport& options, Diagnostics& diagnostics);

struct PointingImport {
  std::string azimuth = "C", altitude = "A";  // axes that carry the tube as the machine's part, azimuth first
  double u_random_urad = 5.0;                 // assumed: the file does not say; about one second of arc
  std::size_t parts = 4;                      // as of a map
};
/// A list of stars as TPOINT reads it, for a mount in azimuth and altitude (`: ALTAZ`) with four columns of
/// degrees: azimuth and altitude observed, azimuth and altitude of the mount. The tube is the machine's part,
/// seen from the sky: it looks along +Z at altitude 90 deg, where the position of the altitude's axis, 90 deg
/// less altitude, is 0. Each star is two readings of a rotation.
Result<std::string> import_pointing(std::string_view text, const std::string& file, const Machine& machine,
                                    const PointingImport& options, Diagnostics& diagnostics);

}  // namespace trunnion::diagnosis
