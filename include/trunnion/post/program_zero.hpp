#pragma once
#include <array>
#include <string>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::post {

/// What X, Y and Z of a program are.
enum class WordsOf : std::uint8_t {
  tip,      // the tool tip in the machine: the control adds the tool length
  spindle,  // the spindle's gauge point: the control adds no length
  part      // the tool tip in the part: tool-centre-point control
};

/// Where the operator has to put the zero from which the words of a program count.
struct ProgramZero {
  WordsOf words = WordsOf::tip;
  std::string offset_name;  // G54, or as the control calls it
  /// A position of X, Y and Z in machine coordinates, mm: what G53, SUPA or M91 means, without tool length.
  struct Place {
    std::vector<std::string> axes;
    std::vector<double> at_mm;
  };
  Place offset;     // at which the work offset must stand, with the rotary axes at 0
  Place part_zero;  // over which the gauge point stands where the part's zero is, with the rotary axes at 0
  std::string rotary_at_zero;  // "A0 C0"
};

/// `words`: as they are where no plane and no tool-centre-point control is on; `WordsOf::part` under it.
ProgramZero program_zero(const Machine& machine, const nc::Controller& controller, std::int64_t work_offset,
                         WordsOf words);

/// The same as lines that an operator reads.
std::vector<std::string> zero_lines(const ProgramZero& zero);

/// Warns, with the numbers, of a zero that can hardly be meant: a work offset beyond the travel, a part zero
/// that no tool reaches, an offset of nothing while the part's zero is far from the machine's.
void warn_of_zero(const Machine& machine, const ProgramZero& zero, double tool_length_mm,
                  Diagnostics& diagnostics);

}  // namespace trunnion::post
