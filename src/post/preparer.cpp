#include "post/preparer.hpp"

#include <algorithm>

namespace trunnion::post {

Preparer::Preparer(const Machine& machine, const Vec3& tool_mm, const path::Rounding& rounding,
                   const PostOptions& options)
    : rounding_(rounding),
      kinematics_(machine, tool_mm),
      refiner_(machine, tool_mm, rounding, options.nonlinear),
      grid_(kinematics_, rounding),
      whole_runs_(options.nonlinear.thin || options.nonlinear.move_programmed_points) {}

void Preparer::place(Chunk& chunk) {
  const std::size_t count = chunk.motions.size();
  chunk.points.clear();
  chunk.points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const path::ChoicePoint& programmed = chunk.motions[i].point;
    path::Point& point = chunk.points.emplace_back();
    point.q = chunk.chosen[i].q;
    point.tip_P = programmed.pose.tip_P;
    point.axis_P = programmed.pose.axis_P;
    point.where = programmed.where;
  }
  if (kinematics_.side_by_side())
    return grid_.place(chunk.has_before ? &chunk.before : nullptr, chunk.points, chunk.chosen);
  sines_.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    sines_[i] = path::round_to_words(kinematics_, rounding_, chunk.points[i].tip_P, chunk.points[i].q,
                                     chunk.chosen[i].sines);
}

void Preparer::decide(Chunk& chunk, std::size_t i, const path::Tolerance& tolerance, bool judged) {
  PreparedSegment& segment = chunk.segments[i];
  segment.known = true;
  segment.tolerance = tolerance;
  segment.first = chunk.inserted.size();
  if (judged && grid_.keeps(i) && grid_.bow_mm(i) <= known_mm_ && refiner_.bounds_decide()) {
    segment.report = refiner_.kept();
    return;
  }
  const path::Point& from = i == 0 ? chunk.before : chunk.points[i - 1];
  const TableKinematics::Sines sines = kinematics_.side_by_side() ? grid_.sines(i) : sines_[i];
  segment.report = refiner_.decide(from, chunk.points[i], tolerance, known_mm_, chunk.inserted, &sines);
  known_mm_ = std::max(known_mm_, std::min(segment.report.predicted_mm, segment.report.midpoint_mm));
}

void Preparer::prepare(Chunk& chunk) {
  if (chunk.failure) return;
  place(chunk);
  const std::size_t count = chunk.motions.size();
  chunk.segments.assign(count, {});
  if (whole_runs_ || count == 0) return;
  std::size_t next = 0;
  path::Tolerance tolerance = chunk.tolerances[0].tolerance;
  // Where the tolerance changes within the chunk the refiner decides.
  const bool judged = kinematics_.side_by_side() && chunk.tolerances.size() == 1;
  if (judged) grid_.judge(tolerance);
  for (std::size_t i = 0; i < count; ++i) {
    for (; next < chunk.tolerances.size() && chunk.tolerances[next].motion <= i; ++next) {
      tolerance = chunk.tolerances[next].tolerance;
    }
    if (chunk.motions[i].point.rapid || chunk.chosen[i].reconfigure || (i == 0 && !chunk.has_before))
      continue;
    decide(chunk, i, tolerance, judged);
  }
}

}  // namespace trunnion::post
