#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/effects/library.hpp"
#include "trunnion/effects/state_track.hpp"

namespace trunnion::diagnosis {

enum class Quantity : std::uint8_t { displacement, rotation };
/// The axes in which a direction of sensitivity is given; one in P turns with the table.
enum class SensitivityFrame : std::uint8_t { machine, part };

/// One scalar reading: `value = n . deviation`, actual minus nominal, of the tool relative to the part.
struct Reading {
  std::size_t row = 0;  // of Dataset::rows and Dataset::track
  Quantity quantity = Quantity::displacement;
  SensitivityFrame frame = SensitivityFrame::machine;
  Vec3 n = Vec3::UnitX();          // unit length
  double value = 0.0;              // mm, rad
  double u_random = 0.0;           // standard uncertainty of one reading, > 0; mm, rad
  std::optional<double> u_common;  // of the offset shared by the group; nothing: to be estimated
  bool zeroed = false;  // u_common is not given, and the instrument was set to 0 where the group begins
  /// Readings of one run with the same quantity, frame and n (within 1e-6) share one offset: index of that
  /// group.
  std::size_t group = 0;
};

/// Where a row came from and which point of the tool it measured.
struct RowOrigin {
  std::size_t file = 0;  // of Dataset::files
  std::uint32_t line = 0;
  Vec3 tool_mm = Vec3::Zero();  // from S to the measured point
};

/// Measurements of one machine: the states that it went through and the readings taken.
struct Dataset {
  std::vector<std::string> files;
  EffectContext context;  // sensors and runs
  StateTrack track;
  std::vector<RowOrigin> rows;    // as many as the track has
  std::vector<Reading> readings;  // rows without a value have none
  std::size_t group_count = 0;

  std::size_t run_of(const Reading& reading) const { return track.state(reading.row).run; }
};

/// A file's text with its name, for parsing.
struct NamedText {
  std::string file;
  std::string text;
};

/// Reads measurement files (README of this layer, "Measurement file"). A run_id that several files use is one
/// run when its times go on from file to file, else each file has a run of its own (`id (file)`), with a
/// note. Every faulty field is reported with file:line:column; fails when there is one, or no reading at all.
Result<Dataset> parse_measurements(std::span<const NamedText> files, const Machine& machine,
                                   Diagnostics& diagnostics);
Result<Dataset> load_measurements(const std::vector<std::string>& paths, const Machine& machine,
                                  Diagnostics& diagnostics);

/// A dataset from its parts: sorts nothing, groups the readings. `states` carry the run and the sensors of
/// `context`.
Dataset make_dataset(EffectContext context, std::span<const MachineState> states, std::vector<RowOrigin> rows,
                     std::vector<Reading> readings);

/// CSV text that parse_measurements reads back to the same data (10 significant digits). `comments` go first,
/// one line each.
std::string measurements_text(const Dataset& data, const Machine& machine,
                              const std::vector<std::string>& comments = {});

}  // namespace trunnion::diagnosis
