#pragma once
#include <vector>

#include "trunnion/base/diagnostics.hpp"
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

/// All motions of a path, arcs as chords within a tenth of the tolerance. `said` gets what its text has to
/// say beside them; fails with the first of its errors.
Result<std::vector<ClPoint>> cl_points(PathText path, const PathTolerance& tolerance,
                                       const ToolOptions& tools, Diagnostics& said);

}  // namespace trunnion::post
