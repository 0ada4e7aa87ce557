#pragma once
#include <map>
#include <string>
#include <string_view>

#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// What a person says of a machine whose linear axes carry the tool and whose rotary axes carry the part.
struct NewMachine {
  std::string name;
  std::optional<std::string> controller;
  std::string rotary;  // letters from the bed outwards: "AC", "BC", "C"
  /// The table turns positively (right hand about X, Y, Z of the machine) for a positive command; else the
  /// tool does as seen from the part, as ISO 841 has it.
  bool table_turns_positively = false;
  std::map<char, Vec3> points_mm;  // a point on each rotary axis: where the gauge point would stand
  struct Travel {
    double min = 0.0;  // mm, rad
    double max = 0.0;
    bool cyclic = false;  // then without limits
  };
  std::map<char, Travel> travel;        // of every axis
  std::map<char, double> rapid;         // mm/s, rad/s; may be left out
  std::map<char, double> acceleration;  // mm/s2, rad/s2; may be left out
  std::map<char, double> jerk;          // mm/s3, rad/s3; may be left out
  /// The CL file's zero, rotary axes at 0; nothing: the point that is given of the innermost rotary axis.
  std::optional<Vec3> part_zero_mm;
  double tool_length_mm = 0.0;  // gauge length
  bool switchable_kinematics = false;
};

/// TOML text of the machine file, with comments that say what each figure is. `source`: where the figures
/// come from, lines of a comment at its head.
std::string machine_file_text(const NewMachine& machine, const std::string& source);

/// The machine that the configuration (ini) of an open control describes: kinematics modules
/// `xyzac-trt-kins` and `xyzbc-trt-kins` with their pins (set by HALCMD or in HAL files beside the ini),
/// travels and speeds of [AXIS_...], else [JOINT_n]. Reports what is missing or not understood to
/// `diagnostics`; fails with wrong_input.
Result<NewMachine> machine_of_ini(std::string_view text, const std::string& file, Diagnostics& diagnostics);

}  // namespace trunnion
