#include "post/intake/path_modes.hpp"

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {

double PathModes::retract_way_mm(const path::Point& point, SourceRef where, Posting& posting) const {
  if (!clear_plane) return posting.options.retract.way_mm;
  const double rises = point.axis_P.dot(clear_plane->normal_P);
  const double missing = clear_plane->distance_mm - point.tip_P.dot(clear_plane->normal_P);
  if (rises > 1e-3 && missing > 0.0) return missing / rises;
  posting.diagnostics.warning(
      posting.job.cl_file, where,
      "the tool does not come to the clearance plane (CLEARP) along its axis: it leaves by " +
          shortest_text(posting.options.retract.way_mm) + " mm");
  return posting.options.retract.way_mm;
}

}  // namespace trunnion::post
