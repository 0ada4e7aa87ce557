#pragma once
#include <vector>

#include "trunnion/post/path_text.hpp"
#include "trunnion/post/tools.hpp"

namespace trunnion::post {

/// A point of a CL path, as the verification reads it.
struct ClPoint {
  Vec3 tip_P = Vec3::Zero();
  Vec3 axis_P = Vec3::UnitZ();
  double flute_mm = 0.0;  // FluteLength of the tool that goes there
  std::uint32_t line = 0;
  bool rapid = false;
};

/// What the verification of a path was told of it.
struct PathTolerance {
  double mm = 0.0;
  Angle axis;
};

/// All motions of a path, arcs as chords within a tenth of the tolerance. What its text has to say beside
/// them was said when it was verified: nothing is reported twice.
Result<std::vector<ClPoint>> cl_points(PathText path, const PathTolerance& tolerance,
                                       const ToolOptions& tools);

}  // namespace trunnion::post
