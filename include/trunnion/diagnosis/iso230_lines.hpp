#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/geom/vec.hpp"

namespace trunnion::iso230 {

/// One reading of a measurement file as the standards' evaluations need it: where the axes stood and what was
/// read. Internal units (mm, rad); axes in the order X Y Z A B C.
struct Reading {
  static constexpr std::string_view kAxes = "XYZABC";
  std::string run;
  double position[6]{};
  int direction[6]{};  // +1, -1: sense of the axis' last motion; 0 unknown
  bool rotation = false;
  bool part_frame = false;
  Vec3 n = Vec3::Zero();   // direction of sensitivity, unit length
  double deviation = 0.0;  // actual - nominal along n, mm or rad
  std::uint32_t line = 0;  // in the file
};

struct Readings {
  std::string file;
  std::vector<Reading> rows;
};

/// Reads a measurement file (CSV of the project's interfaces). Rows without a value are passed over. Columns
/// of axes that are absent count as 0. Faults are reported with file:line:column.
Result<Readings> parse_readings(std::string_view csv, const std::string& file, Diagnostics& diagnostics);

/// The data of one positioning test along one line: an axis (ISO 230-2) or a diagonal (ISO 230-6).
struct LineTest {
  std::string name;                 // "X", "C", or the diagonal's axes with their senses: "+X+Y", "+X-Y+Z"
  bool rotary = false;              // mm or rad
  Vec3 direction_M = Vec3::Zero();  // of increasing target; zero for a rotary axis
  std::vector<double> target;       // ascending, mm or rad
  /// Deviations x_ij = actual - target at [target i][run j], mm or rad; a direction that was not measured is
  /// empty.
  std::vector<std::vector<double>> up, down;
};

/// One line per axis whose own positioning was read (n along the axis, all other axes at rest).
Result<std::vector<LineTest>> axis_lines(const Readings& readings);
/// One line per direction n with at least two moving axes.
Result<std::vector<LineTest>> diagonal_lines(const Readings& readings);

/// Reads the shell-variable text that the ecmc motion-test logger writes: `TGT_DATA[i]=`,
/// `REF_DATA_FWD[i,j]=`, `REF_DATA_BWD[i,j]=`, `UNIT=mm`. `name` becomes the name of the line.
Result<LineTest> parse_motion_log(std::string_view text, const std::string& file, const std::string& name,
                                  Diagnostics& diagnostics);
/// Whether `text` looks like such a log.
bool is_motion_log(std::string_view text);

}  // namespace trunnion::iso230
