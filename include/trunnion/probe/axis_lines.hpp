#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "trunnion/machine/machine.hpp"

namespace trunnion::probe {

/// What a ball on the table tells of a machine file: each rotary axis as a line in M. Four numbers an axis
/// move it from where the file has it, exactly, however large they are: the point by two lengths across the
/// axis, the direction by two angles (Rodrigues). Along its line a point says nothing, and about its own
/// direction a line does not turn, so that four are all.
class AxisLines {
 public:
  static constexpr Eigen::Index kEach = 4;  // two of the point (mm), two of the direction (rad)

  /// About the lines of `machine`, which is copied.
  explicit AxisLines(const Machine& machine);

  Eigen::Index count() const { return kEach * static_cast<Eigen::Index>(axes_.size()); }
  /// The machine with its rotary axes moved by `by` (count() numbers).
  Machine moved(const Eigen::VectorXd& by) const;
  /// Rotary axes, from the bed outwards.
  const std::vector<AxisId>& axes() const { return axes_; }
  /// Two unit vectors across axis k, square to each other: those of M where the axis is along X, Y or Z.
  const std::array<Vec3, 2>& across(std::size_t k) const { return across_[k]; }

 private:
  Machine machine_;
  std::vector<AxisId> axes_;
  std::vector<std::array<Vec3, 2>> across_;
};

}  // namespace trunnion::probe
