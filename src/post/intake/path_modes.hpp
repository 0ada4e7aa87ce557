#pragma once
#include <optional>

#include "trunnion/path/point.hpp"

#include "post/intake/path_tolerances.hpp"
#include "post/making/post_words.hpp"
#include "post/making/posting.hpp"

namespace trunnion::post {

/// What words of the CL file leave in force for the motions behind them.
struct PathModes {
  PathTolerances tolerances;              // LINTOL
  std::optional<ClearPlane> clear_plane;  // CLEARP

  /// How far the tool leaves the part along its axis from `point`, mm: to the clearance plane, else as far as
  /// the options say; warns where it does not come there.
  double retract_way_mm(const path::Point& point, SourceRef where, Posting& posting) const;
  /// The same, however high the safe height is.
  double way_asked_mm(const path::Point& point, SourceRef where, Posting& posting) const;
};

}  // namespace trunnion::post
