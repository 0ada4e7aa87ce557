#pragma once
#include <array>
#include <cstdint>

#include "trunnion/nc/blocks.hpp"

namespace trunnion::nc {

/// Shift and turn about Z by which the words of a program count away from its work offset (G52, G92, G68,
/// TRANS, AROT). Places are in quanta of the linear format, in the coordinates of the work offset
/// (`position`) or in the program's own.
class ProgramFrame {
 public:
  bool is_idle() const { return !turns_ && shift_ == std::array<std::int64_t, 3>{}; }
  bool turns() const { return turns_; }
  void reset() { *this = {}; }
  /// The program's zero in this axis, in coordinates of the work offset.
  void set_shift(AxisLetter letter, std::int64_t quanta) { shift_[index(letter)] = quanta; }
  std::int64_t shift(AxisLetter letter) const { return shift_[index(letter)]; }
  /// The program's zero goes on by this much along its own axes.
  void shift_further(const std::array<std::int64_t, 3>& way);
  /// About the program's point x, y; against the clock as seen from above.
  void turn_about(std::int64_t x, std::int64_t y, double rad);

  /// Coordinates of the work offset. Where the frame turns X and Y are known together, or neither is.
  AxisWords position_of(AxisWords program) const;
  AxisWords program_of(AxisWords position) const;

 private:
  std::array<std::int64_t, 3> shift_{};
  bool turns_ = false;
  double angle_rad_ = 0.0, cosine_ = 1.0, sine_ = 0.0;
};

}  // namespace trunnion::nc
