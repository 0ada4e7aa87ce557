#pragma once
#include <span>
#include <vector>

#include "trace/joint_path.hpp"

// Private to the layer: the CL path beside the blocks of the program.
namespace trunnion::trace {

/// How far a tool is off the CL path.
struct OffPath {
  double tip_mm = 0.0;
  double axis_rad = 0.0;  // from the axis that the path has where the tip is
  double flute_mm = 0.0;
  Vec3 error_P = Vec3::Zero();  // of the tip, from the nearest place of the path
};

/// Which pieces of the CL path each block passes, and how far a tool is off them.
class ClCourse {
 public:
  ClCourse(const Machine& machine, const Plan& plan);

  /// Of a tool seen in the blocks `first` to `last` of the program.
  OffPath off(const ToolPose& tool, std::size_t first, std::size_t last) const;

 private:
  std::size_t place_of(const ToolPose& tool, std::uint32_t line, std::size_t from) const;

  const std::vector<PathPoint>& path_;
  std::vector<std::size_t>
      of_block_;  // the piece of the path on which each block ends: the number of its end
};

}  // namespace trunnion::trace
