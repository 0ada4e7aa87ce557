#include "post/intake/path_modes.hpp"

#include <algorithm>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {

namespace {

// The spindle stands along Z: Z goes as far as the tool does. Above the safe height there is nothing to flee.
double up_to_safe_height(double way_mm, const path::Point& point, const Machine& machine) {
  const auto id = machine.axis("Z");
  if (!id || !machine.safe.z_mm()) return way_mm;
  const double room_mm = (machine.safe.away < 0 ? -1.0 : 1.0) * (*machine.safe.z_mm() - point.q[*id]);
  return room_mm > 0.0 ? std::min(way_mm, room_mm) : way_mm;
}

}  // namespace

double PathModes::retract_way_mm(const path::Point& point, SourceRef where, Posting& posting) const {
  return up_to_safe_height(way_asked_mm(point, where, posting), point, posting.machine);
}

double PathModes::way_asked_mm(const path::Point& point, SourceRef where, Posting& posting) const {
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
