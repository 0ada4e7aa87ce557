#include "post/preparer.hpp"

#include <algorithm>

namespace trunnion::post {

Preparer::Preparer(const Machine& machine, const Vec3& tool_mm, const path::Rounding& rounding,
                   const PostOptions& options)
    : rounding_(rounding),
      kinematics_(machine, tool_mm),
      refiner_(machine, tool_mm, rounding, options.nonlinear),
      whole_runs_(options.nonlinear.thin || options.nonlinear.move_programmed_points) {}

void Preparer::prepare(Chunk& chunk) {
  if (chunk.failure) return;
  const std::size_t count = chunk.motions.size();
  chunk.points.clear();
  chunk.points.reserve(count);
  sines_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const path::ChoicePoint& programmed = chunk.motions[i].point;
    const path::ChosenPoint& chosen = chunk.chosen[i];
    path::Point& point = chunk.points.emplace_back();
    point.q = chosen.q;
    point.tip_P = programmed.pose.tip_P;
    point.axis_P = programmed.pose.axis_P;
    point.where = programmed.where;
    sines_[i] = path::round_to_words(kinematics_, rounding_, point.tip_P, point.q, chosen.sines);
  }
  chunk.segments.assign(count, {});
  if (whole_runs_) return;
  std::size_t next = 0;
  path::Tolerance tolerance;
  for (std::size_t i = 0; i < count; ++i) {
    for (; next < chunk.tolerances.size() && chunk.tolerances[next].motion <= i; ++next) {
      tolerance = chunk.tolerances[next].tolerance;
    }
    if (chunk.motions[i].point.rapid || chunk.chosen[i].reconfigure || (i == 0 && !chunk.has_before))
      continue;
    PreparedSegment& segment = chunk.segments[i];
    segment.known = true;
    segment.tolerance = tolerance;
    segment.first = chunk.inserted.size();
    segment.report = refiner_.decide(i == 0 ? chunk.before : chunk.points[i - 1], chunk.points[i], tolerance,
                                     known_mm_, chunk.inserted, &sines_[i]);
    known_mm_ = std::max(known_mm_, std::min(segment.report.predicted_mm, segment.report.midpoint_mm));
  }
}

}  // namespace trunnion::post
